// SPDX-License-Identifier: Apache-2.0
// Cameras of an isocentric C-arm from its two angles: the chapter's Eq 4 in corrected form. As printed, Eq 4 does not
// give the identity for two equal positions of the arm. The corrected form is the absolute pose W_i = R_beta R_alpha
// R_0 of each view. The relative motion of two views is R_21 = W_2^T W_1.
#include <marrow/plugin.hpp>

namespace {

struct Options {
  std::vector<std::string> names{"frontal", "lateral"};
  std::vector<double> alpha_deg{0, 0};
  std::vector<double> beta_deg{0, 90};
  double source_to_detector_mm = 1000;
  double source_to_isocentre_mm = 600;
  int width_px = 512;
  int height_px = 512;
  double pixel_mm = 0.586;
  Eigen::Vector3d isocentre_mm = Eigen::Vector3d::Zero();
};

marrow::Camera camera_at(const Options& options, double alpha_deg, double beta_deg) {
  const marrow::CArm arm{options.width_px,
                         options.height_px,
                         Eigen::Vector2d::Constant(options.pixel_mm),
                         options.source_to_detector_mm,
                         options.source_to_isocentre_mm,
                         options.isocentre_mm};
  return marrow::carm_camera(arm,
                             marrow::world_from_camera_rotation(marrow::radians(alpha_deg), marrow::radians(beta_deg)));
}

marrow::List<marrow::Camera> carm(const Options& options) {
  marrow::List<marrow::Camera> cameras;
  for (std::size_t i = 0; i < options.names.size(); ++i) {
    marrow::Camera camera = camera_at(options, options.alpha_deg.at(i), options.beta_deg.at(i));
    marrow::check_camera(camera, "view '" + options.names[i] + "'");
    cameras.add(options.names[i], std::move(camera));
  }
  return cameras;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.carm", carm)
      .summary(
          "Cameras of an isocentric C-arm from its angles (Eq 4, corrected); the angles have the signs of DICOM's "
          "positioner angles")
      .out("camera", "camera of each view", marrow::over("view"))
      .option("names", &Options::names, "one name per view")
      .relation(marrow::at_least_one({"names"}))
      .relation(marrow::distinct("names"))
      .option("alpha_deg", &Options::alpha_deg,
              "cranio-caudal angle of each view, positive if the detector is towards the head", marrow::at_least(-90),
              marrow::at_most(90))
      .option("beta_deg", &Options::beta_deg,
              "right/left anterior angle of each view, positive if the detector is towards the patient's left",
              marrow::at_least(-180), marrow::at_most(180))
      .relation(marrow::same_length({"names", "alpha_deg", "beta_deg"}))
      .option("source_to_detector_mm", &Options::source_to_detector_mm, "distance from the source to the detector",
              marrow::at_least(1))
      .option("source_to_isocentre_mm", &Options::source_to_isocentre_mm,
              "distance from the source to the centre of rotation", marrow::at_least(1))
      .relation(marrow::below("source_to_isocentre_mm", "source_to_detector_mm"))
      .option("width_px", &Options::width_px, "image width", marrow::at_least(1), marrow::at_most(16384))
      .option("height_px", &Options::height_px, "image height", marrow::at_least(1), marrow::at_most(16384))
      .option("pixel_mm", &Options::pixel_mm, "size of a pixel on the detector", marrow::at_least(0.001))
      .option("isocentre_mm", &Options::isocentre_mm, "centre of rotation in world coordinates");
}
