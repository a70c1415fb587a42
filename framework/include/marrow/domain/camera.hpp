// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <tuple>
#include <vector>

#include "marrow/domain/image.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow {

/// Pinhole model of an X-ray view (the chapter's Eq 1-3 as corrected in docs/method.md), OpenCV's convention: the
/// source is the camera's origin, +z runs to the detector, u to the right and v down. pixel = intrinsics *
/// (camera_from_world * X), divided by the third coordinate; intrinsics = [f/pix_u s u0; 0 f/pix_v v0; 0 0 1] with f =
/// source-to-detector distance.
struct Camera {
  int width_px = 0;
  int height_px = 0;
  Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
  RigidTransform camera_from_world{"camera", "world"};

  static constexpr auto fields() {
    return std::make_tuple(&Camera::width_px, &Camera::height_px, &Camera::intrinsics, &Camera::camera_from_world);
  }
};

/// Pixel of a world point. The point must lie in front of the source (z > 0 in the camera's frame); else NaN.
Eigen::Vector2d project(const Camera& camera, const Eigen::Vector3d& world_mm);

/// The X-ray source in world coordinates.
Eigen::Vector3d source_position_mm(const Camera& camera);

/// Unit direction, in world coordinates, of the ray from the source through a pixel.
Eigen::Vector3d ray_direction(const Camera& camera, const Eigen::Vector2d& pixel);

/// Plane {X : normal . X = offset_mm} in world coordinates through the source and the image line a u + b v + c = 0: the
/// exact back-projection M^T l (Hartley and Zisserman 2004, 8.1), where the chapter's Eq 7 uses an orthogonal one.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset_mm = 0;
};
Plane back_project_line(const Camera& camera, const Eigen::Vector3d& line);

/// mm per pixel at a world point, across the viewing direction: how far a point there moves for one pixel.
double pixel_size_at_mm(const Camera& camera, const Eigen::Vector3d& world_mm);

/// Throws Error for a non-positive size or focal length, or a rotation that is not one.
void check_camera(const Camera& camera, const std::string& what);

/// One X-ray view: an image and how it was taken. mask: CV_8U, non-zero where the image may be used; empty =
/// everywhere.
struct View {
  std::string name;
  Image image;
  Camera camera;
  cv::Mat mask;
  static constexpr auto fields() { return std::make_tuple(&View::name, &View::image, &View::camera, &View::mask); }
};

/// Throws Error when image, camera and mask sizes disagree, or the image is empty. The message names the view and both
/// sizes.
void check_view(const View& view);

}  // namespace marrow
