// SPDX-License-Identifier: Apache-2.0
// Views of an isocentric C-arm from its two angles: the chapter's Eq 4 in corrected form. As printed, equal poses of
// the gantry do not give the identity; what is meant is the absolute pose W_i = R_beta R_alpha R_0 of each view, from
// which the relative motion follows as R_21 = W_2^T W_1.
#include <Eigen/Geometry>
#include <marrow/plugin.hpp>
#include <set>

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

/// Axes of the camera (columns u, v, viewing direction) in world coordinates: W = R_beta R_alpha R_0. The signs are
/// those of DICOM's positioner angles (PS3.3 C.8.7.5): +beta (primary, left anterior oblique) moves the detector
/// towards the patient's left, +alpha (secondary, cranial) towards the head.
Eigen::Matrix3d world_from_camera_rotation(double alpha_rad, double beta_rad) {
  // At (0, 0) the detector is in front of the chest: the rays run to -y, the head is up (v to -z), and as the image is
  // seen from the source, u runs to the patient's right.
  Eigen::Matrix3d r_0;
  r_0.col(0) = -Eigen::Vector3d::UnitX();
  r_0.col(1) = -Eigen::Vector3d::UnitZ();
  r_0.col(2) = -Eigen::Vector3d::UnitY();
  const Eigen::AngleAxisd r_alpha(-alpha_rad, Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd r_beta(beta_rad, Eigen::Vector3d::UnitZ());
  return r_beta.toRotationMatrix() * r_alpha.toRotationMatrix() * r_0;
}

marrow::Camera carm_camera(const Options& options, double alpha_deg, double beta_deg) {
  marrow::Camera camera;
  camera.width_px = options.width_px;
  camera.height_px = options.height_px;
  // Integer coordinates are pixel centres, so the middle of the detector is half a pixel less than half its width.
  const double focal_px = options.source_to_detector_mm / options.pixel_mm;
  camera.intrinsics << focal_px, 0, (options.width_px - 1) / 2.0, 0, focal_px, (options.height_px - 1) / 2.0, 0, 0, 1;
  const Eigen::Matrix3d world_from_camera =
      world_from_camera_rotation(marrow::radians(alpha_deg), marrow::radians(beta_deg));
  const Eigen::Vector3d source_mm = options.isocentre_mm - options.source_to_isocentre_mm * world_from_camera.col(2);
  camera.camera_from_world.rotation = world_from_camera.transpose();
  camera.camera_from_world.translation_mm = -(world_from_camera.transpose() * source_mm);
  return camera;
}

void check_options(const Options& options) {
  const std::size_t count = options.names.size();
  if (count == 0) throw marrow::Error("names: no view is named; name at least one");
  if (options.alpha_deg.size() != count || options.beta_deg.size() != count)
    throw marrow::Error("names has " + std::to_string(count) + " views, alpha_deg " +
                        std::to_string(options.alpha_deg.size()) + " and beta_deg " +
                        std::to_string(options.beta_deg.size()) + " angles; give one of each per view");
  if (std::set<std::string>(options.names.begin(), options.names.end()).size() != count)
    throw marrow::Error("names: two views have the same name");
  if (options.source_to_isocentre_mm >= options.source_to_detector_mm)
    throw marrow::Error("source_to_isocentre_mm (" + std::to_string(options.source_to_isocentre_mm) +
                        ") must be less than source_to_detector_mm (" + std::to_string(options.source_to_detector_mm) +
                        "): the detector lies behind the isocentre");
}

marrow::List<marrow::Camera> carm(const Options& options) {
  check_options(options);
  marrow::List<marrow::Camera> cameras;
  for (std::size_t i = 0; i < options.names.size(); ++i) {
    marrow::Camera camera = carm_camera(options, options.alpha_deg[i], options.beta_deg[i]);
    marrow::check_camera(camera, "view '" + options.names[i] + "'");
    cameras.add(options.names[i], std::move(camera));
  }
  return cameras;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.carm", carm)
      .summary("Views of an isocentric C-arm from its angles (Eq 4, corrected; signs of DICOM's positioner angles)")
      .out("camera", "geometry of each view", marrow::over("view"))
      .option("names", &Options::names, "one name per view")
      .option("alpha_deg", &Options::alpha_deg,
              "cranio-caudal angle per view, positive with the detector towards the head", marrow::at_least(-90),
              marrow::at_most(90))
      .option("beta_deg", &Options::beta_deg,
              "right/left anterior angle per view, positive with the detector towards the patient's left",
              marrow::at_least(-180), marrow::at_most(180))
      .option("source_to_detector_mm", &Options::source_to_detector_mm, "source to detector", marrow::at_least(1))
      .option("source_to_isocentre_mm", &Options::source_to_isocentre_mm, "source to the centre of rotation",
              marrow::at_least(1))
      .option("width_px", &Options::width_px, "image width", marrow::at_least(1), marrow::at_most(16384))
      .option("height_px", &Options::height_px, "image height", marrow::at_least(1), marrow::at_most(16384))
      .option("pixel_mm", &Options::pixel_mm, "size of a pixel on the detector", marrow::at_least(0.001))
      .option("isocentre_mm", &Options::isocentre_mm, "centre of rotation in world coordinates");
}
