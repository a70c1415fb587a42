// SPDX-License-Identifier: Apache-2.0
// What RTK's angles, distances and offsets mean (RTK's documentation, "RTK geometry").
#include "marrow/toolbox/exchange/rtk_geometry.hpp"

#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4>;

Eigen::Matrix3d about(int axis, double angle_deg) {
  return rotation_from_vector(radians(angle_deg) * Eigen::Vector3d::Unit(axis));
}

/// The axes of the detector: rows u, v and towards the source.
Eigen::Matrix3d detector_axes(const RtkProjection& p) {
  return about(2, -p.in_plane_deg) * about(0, -p.out_of_plane_deg) * about(1, -p.gantry_deg);
}

void set_angles(RtkProjection& p, const Eigen::Matrix3d& axes) {
  const double sine = std::clamp(axes(2, 1), -1.0, 1.0);
  p.out_of_plane_deg = -degrees(std::asin(sine));
  if (std::abs(sine) < 1 - 1e-12) {
    p.gantry_deg = -degrees(std::atan2(-axes(2, 0), axes(2, 2)));
    p.in_plane_deg = -degrees(std::atan2(-axes(0, 1), axes(1, 1)));
  } else {  // the two other angles turn about the same axis
    p.in_plane_deg = -degrees(std::atan2(axes(1, 0), axes(0, 0)));
  }
}

}  // namespace

Matrix34 rtk_matrix(const RtkProjection& p) {
  Eigen::Matrix4d rotation = Eigen::Matrix4d::Identity(), to_source = Eigen::Matrix4d::Identity();
  rotation.topLeftCorner<3, 3>() = detector_axes(p);
  to_source.topRightCorner<2, 1>() << -p.source_x_mm, -p.source_y_mm;
  Matrix34 magnification;
  magnification << -p.source_to_detector_mm, 0, 0, 0,  //
      0, -p.source_to_detector_mm, 0, 0,               //
      0, 0, 1, -p.source_to_isocentre_mm;
  Eigen::Matrix3d to_detector = Eigen::Matrix3d::Identity();
  to_detector.topRightCorner<2, 1>() << p.source_x_mm - p.projection_x_mm, p.source_y_mm - p.projection_y_mm;
  return to_detector * magnification * to_source * rotation;
}

RtkProjection projection_of(const Camera& camera, const Eigen::Vector2d& pixel_mm, const std::string& what) {
  const Eigen::Matrix3d& k = camera.intrinsics;
  const Eigen::Vector2d focal_mm(k(0, 0) * pixel_mm.x(), k(1, 1) * pixel_mm.y());
  if (std::abs(focal_mm.x() - focal_mm.y()) > 1e-6 * focal_mm.x())
    throw Error(what + ": pixel_mm: with these pixels the detector is " + files::number(focal_mm.x()) +
                " mm from the source by the width and " + files::number(focal_mm.y()) +
                " mm by the height; give the pixel's true width and height");
  if (std::abs(k(0, 1)) > 1e-6 * k(0, 0))
    throw Error(what + ": its pixels are askew (the camera matrix has " + files::number(k(0, 1)) +
                " in its first row's second place), which RTK's geometry cannot hold");
  RtkProjection p;
  const Eigen::Vector3d flip(1, -1, -1);
  set_angles(p, flip.asDiagonal() * camera.camera_from_world.rotation);
  const Eigen::Vector3d source = -flip.cwiseProduct(camera.camera_from_world.translation_mm);
  p.source_to_isocentre_mm = source.z();
  p.source_to_detector_mm = focal_mm.x();
  p.source_x_mm = source.x();
  p.source_y_mm = source.y();
  p.projection_x_mm = source.x() - (k(0, 2) - 0.5 * (camera.width_px - 1)) * pixel_mm.x();
  p.projection_y_mm = source.y() + (k(1, 2) - 0.5 * (camera.height_px - 1)) * pixel_mm.y();
  return p;
}

Camera camera_of(const RtkProjection& projection, const ImageSize& size, Mirror mirror, const std::string& what) {
  const Eigen::Vector2i pixels = size_px(size, what);
  const Eigen::Vector2d spacing = pixel_mm(size.pixel_mm, what), corner = corner_mm(size, what);
  Eigen::Matrix3d pixel_from_mm = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 2; ++i) {
    pixel_from_mm(i, i) = 1 / spacing[i];
    pixel_from_mm(i, 2) = -corner[i] / spacing[i];
  }
  return camera_of(Matrix34(-pixel_from_mm * rtk_matrix(projection)), pixels, mirror, what);
}

}  // namespace marrow::exchange
