// SPDX-License-Identifier: Apache-2.0
// What each pixel of a simulated image shows: the truth for the training of networks and for measures of what they
// find. The borders of the bone are those of evaluate.true_edges.
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <marrow/plugin.hpp>

#include "marrow/simulate/collimator.hpp"
#include "marrow/simulate/posture.hpp"
#include "marrow/simulate/solid.hpp"

namespace {

using namespace marrow;
using phantom::ClutteredPhantom;

struct LabelOptions {
  std::string collimator = "off";
  int collimator_seed = 1;
};

constexpr std::uint8_t kBone = 80, kMetal = 160, kOutside = 240;
constexpr double kNearestMm = 10;
constexpr double kLeastBeam = 0.5;  // less of it is outside of the field

/// The rays through the middles of a camera's pixels; depth is -1/z, so that planes stay planes.
phantom::SolidRays::Map rays_of(const Camera& camera, const RigidTransform& camera_from_body) {
  return [&camera, camera_from_body](const Eigen::Vector3d& point) {
    const Eigen::Vector3d x = camera_from_body * point;
    if (!(x.z() >= kNearestMm))
      throw Error(
          formatted("simulate.labels: something in the beam reaches to {:f} mm from the X-ray source; it must "
                    "lie in front of the source, so check the camera's distances",
                    x.z()));
    const Eigen::Vector2d pixel = (camera.intrinsics * x).hnormalized();
    return phantom::RayVertex{pixel.x(), pixel.y(), -1 / x.z()};
  };
}

bool is_bone(const std::string& material) { return material == "cortical bone" || material == "cancellous bone"; }

/// Bone and metal in a camera's image: metal is seen also where it hides bone.
cv::Mat1b bone_and_metal(const ClutteredPhantom& cluttered, const Camera& camera) {
  cv::Mat1b classes(camera.height_px, camera.width_px, std::uint8_t(0));
  const phantom::SolidRays bone(cluttered.phantom, classes.cols, classes.rows, [&](const phantom::Fragment& fragment) {
    return rays_of(camera, camera.camera_from_world * fragment.world_from_bone());
  });
  std::vector<const phantom::Body*> seen;
  std::vector<std::uint8_t> shown;
  for (const phantom::Body& body : cluttered.bodies) {
    const bool is_metal = phantom::material(body.material).is_metal;
    if (!is_metal && !is_bone(body.material)) continue;
    seen.push_back(&body);
    shown.push_back(is_metal ? kMetal : kBone);
  }
  const phantom::BodyRays others(seen, classes.cols, classes.rows,
                                 [&](const phantom::Body&) { return rays_of(camera, camera.camera_from_world); });
  tbb::parallel_for(0, classes.rows, [&](int row) {
    std::vector<phantom::Interval> in_bone;
    phantom::for_each_ray(bone.bundle().crossings(row, row + 1), [&](std::span<const phantom::Crossing> ray) {
      bone.intervals(ray, in_bone);
      if (!in_bone.empty()) classes(row, int(ray[0].column)) = kBone;
    });
    std::vector<phantom::BodyInterval> in_bodies;
    phantom::for_each_ray(others.bundle().crossings(row, row + 1), [&](std::span<const phantom::Crossing> ray) {
      others.intervals(ray, in_bodies);
      std::uint8_t& pixel = classes(row, int(ray[0].column));
      for (const phantom::BodyInterval& in : in_bodies) pixel = std::max(pixel, shown[std::size_t(in.body)]);
    });
  });
  return classes;
}

List<Image> labels(const ClutteredPhantom& given, const List<Camera>& cameras, const phantom::Posture* posture,
                   const LabelOptions& options, Context& context) {
  phantom::check_phantom(given, "simulate.labels");
  const ClutteredPhantom cluttered = phantom::in_posture(given, posture);
  List<Image> result;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    context.check_cancelled();
    const Camera& camera = cameras[i];
    check_camera(camera, "simulate.labels: camera '" + cameras.name(i) + "'");
    cv::Mat1b classes = bone_and_metal(cluttered, camera);
    const cv::Mat1d passed =
        phantom::passed_by_collimator(classes.size(), options.collimator, std::uint64_t(options.collimator_seed), i);
    if (!passed.empty()) classes.setTo(kOutside, passed < kLeastBeam);
    result.add(cameras.name(i), Image{classes});
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.labels", labels)
      .summary("What each pixel of a simulated image shows, to train networks")
      .in("phantom", "phantom with tissues and bodies, as the images show it")
      .in("cameras", "camera of each view", over("view"))
      .in("posture", "posture of the phantom; if not given, its own")
      .out("classes",
           "8 bits: 0 background, 80 any bone, 160 metal, also before bone, 240 outside of the collimator's field",
           over("view"))
      .option("collimator", &LabelOptions::collimator, "as given to simulate.export",
              one_of({"off", "mild", "usual", "bad"}))
      .option("collimator_seed", &LabelOptions::collimator_seed, "as given to simulate.export", at_least(0));
}
