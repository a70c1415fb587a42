// SPDX-License-Identifier: Apache-2.0
// A camera on a rotary arm, as it really is. Only simulations may know it.

#include "marrow/domain/random.hpp"
#include "marrow/simulate/photograph.hpp"

namespace {

using namespace marrow;

struct Options {
  std::vector<std::string> names{"frontal", "lateral"};
  std::vector<double> angles_deg{0, 90};
  int width_px = 640, height_px = 480;
  double focal_px = 800;
  Eigen::Vector2d principal_offset_px{6, -4};
  double k1 = -0.12, k2 = 0.03;
  double distance_mm = 600;
  double angle_sd_deg = 0.2;
  double repeat_sd_deg = 0.05;
};

phantom::CameraArm camera_arm(const Options& options, Context& context) {
  phantom::CameraArm arm;
  arm.device.width_px = options.width_px;
  arm.device.height_px = options.height_px;
  arm.device.intrinsics << options.focal_px, 0, 0.5 * (options.width_px - 1) + options.principal_offset_px.x(), 0,
      options.focal_px, 0.5 * (options.height_px - 1) + options.principal_offset_px.y(), 0, 0, 1;
  arm.device.distortion.k = {options.k1, options.k2, 0};
  check_distortion(arm.device.intrinsics, arm.device.distortion, options.width_px, options.height_px, "k1 and k2");
  arm.distance_mm = options.distance_mm;
  arm.names = options.names;
  arm.repeat_sd_deg = options.repeat_sd_deg;
  marrow::Random random(context.seed());
  for (const double angle : options.angles_deg)
    arm.angles_deg.push_back(angle + options.angle_sd_deg * random.normal());
  return arm;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.camera_arm", camera_arm)
      .summary("A colour camera on a rotary arm: its lens, where it stops, and how exactly")
      .random()
      .out("arm", "the camera and its arm as they really are, for simulate.photograph and simulate.chessboard")
      .option("names", &Options::names, "one name per stop of the arm")
      .relation(at_least_one({"names"}))
      .relation(distinct("names"))
      .option("angles_deg", &Options::angles_deg,
              "angle of the arm at each stop: 0 looks along +y, 90 along -x, always at the world's origin")
      .relation(same_length({"names", "angles_deg"}))
      .option("width_px", &Options::width_px, "width of the photographs", at_least(64), at_most(4096))
      .option("height_px", &Options::height_px, "height of the photographs", at_least(64), at_most(4096))
      .option("focal_px", &Options::focal_px, "focal length", at_least(10))
      .option("principal_offset_px", &Options::principal_offset_px,
              "offset of the principal point from the middle of the image, to the right and down")
      .option("k1", &Options::k1, "radial distortion that grows with the third power of the radius; negative: barrel",
              unit("1"))
      .option("k2", &Options::k2, "radial distortion that grows with the fifth power", unit("1"))
      .option("distance_mm", &Options::distance_mm, "from the camera to the arm's axis", at_least(50))
      .option("angle_sd_deg", &Options::angle_sd_deg,
              "standard deviation of the angle at which the arm stops, drawn once in a run", at_least(0))
      .option("repeat_sd_deg", &Options::repeat_sd_deg,
              "standard deviation of the angle each time that the arm stops there again", at_least(0));
}
