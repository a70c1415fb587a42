// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras whose projections a hand can compute.
#include <cmath>
#include <marrow/domain/camera.hpp>

namespace marrow::test {

/// At the world's origin, looking along +z. The principal point is the middle of the image unless it is given.
inline Camera pinhole(double focal_px, int width_px, int height_px,
                      const std::optional<Eigen::Vector2d>& principal_px = {}) {
  const Eigen::Vector2d middle = principal_px.value_or(Eigen::Vector2d(width_px - 1, height_px - 1) / 2);
  Camera camera;
  camera.width_px = width_px, camera.height_px = height_px;
  camera.intrinsics << focal_px, 0, middle.x(), 0, focal_px, middle.y(), 0, 0, 1;
  return camera;
}

/// The same, this far before the world's origin.
inline Camera before_origin(Camera camera, double distance_mm) {
  camera.camera_from_world.translation_mm = {0, 0, distance_mm};
  return camera;
}

/// The standard simulated C-arm: 1000 mm from source to detector, 600 to the isocentre, 512 x 512 pixels of 0.586 mm.
/// At angle 0 the source is in front of the patient; at 90 degrees on the right side.
inline Camera c_arm(double angle_deg, int size_px = 512) {
  Camera camera = before_origin(pinhole(1000 / (0.586 * 512 / size_px), size_px, size_px), 600);
  const double a = radians(angle_deg);
  camera.camera_from_world.rotation << std::cos(a), -std::sin(a), 0, 0, 0, -1, std::sin(a), std::cos(a), 0;
  return camera;
}

}  // namespace marrow::test
