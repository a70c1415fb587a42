// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/list.hpp"
#include "marrow/domain/transform.hpp"

namespace MARROW_EXPORT marrow {

/// A fluoroscopic image with one channel of type CV_8U, CV_16U or CV_32F. Air is bright unless a node says otherwise.
/// Pixel (0, 0) is at the top left, and integer coordinates are pixel centres (OpenCV's convention). Never write to the
/// pixels of an Image that you were given: copies of a cv::Mat share them.
struct Image {
  cv::Mat pixels;

  int width() const { return pixels.cols; }
  int height() const { return pixels.rows; }

  using fields = Fields<&Image::pixels>;
};

/// A picture for people: CV_8UC3 in RGB order.
struct Picture {
  cv::Mat pixels;
  using fields = Fields<&Picture::pixels>;
};

/// Pinhole model of an X-ray view in OpenCV's convention (Eq 1-3 of the chapter, as corrected in docs/method.md). The
/// X-ray source is the camera's origin, +z points to the detector, u to the right and v down. pixel = intrinsics *
/// (camera_from_world * X), divided by the third coordinate. intrinsics = [f/pix_u s u0; 0 f/pix_v v0; 0 0 1], where f
/// is the source-to-detector distance.
struct Camera {
  int width_px = 0;
  int height_px = 0;
  Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
  RigidTransform camera_from_world{"camera", "world"};

  using fields = Fields<&Camera::width_px, &Camera::height_px, &Camera::intrinsics, &Camera::camera_from_world>;
};

/// Pixel onto which a world point projects. NaN unless the point is in front of the source (z > 0 in the camera's
/// frame).
Eigen::Vector2d project(const Camera& camera, const Eigen::Vector3d& world_mm);

/// The X-ray source in world coordinates.
Eigen::Vector3d source_position_mm(const Camera& camera);

/// Unit direction, in world coordinates, of the ray from the source through a pixel.
Eigen::Vector3d ray_direction(const Camera& camera, const Eigen::Vector2d& pixel);

/// Plane {X : normal . X = offset_mm} in world coordinates.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset_mm = 0;
};
/// The plane through the source and the image line a u + b v + c = 0. This is the exact back-projection M^T l (Hartley
/// and Zisserman 2004, 8.1); Eq 7 of the chapter uses an orthogonal projection instead.
Plane back_project_line(const Camera& camera, const Eigen::Vector3d& line);

/// How far, along the camera's x and y axes, a world point must move for its image to move by a small offset: the
/// inverse of the projection's derivative. It holds for pixels of any shape.
Eigen::Vector2d offset_at_mm(const Camera& camera, const Eigen::Vector3d& world_mm, const Eigen::Vector2d& offset_px);

/// Size of a pixel at a world point, in mm: the square root of its area there, parallel to the detector. Use it only
/// for lengths without a direction, such as a blur. offset_at_mm() converts an offset in the image.
double pixel_size_at_mm(const Camera& camera, const Eigen::Vector3d& world_mm);

/// Throws Error if the image size is not positive, if a side has more than 65536 pixels, if the camera matrix does not
/// have the form given at Camera, or if a focal length is not positive. Throws as check_rigid() does, too. `what` names
/// the camera in the message.
void check_camera(const Camera& camera, const std::string& what);

/// One X-ray view: an image and its camera. `mask` is CV_8U and non-zero where the image may be used; empty means
/// everywhere.
struct View {
  std::string name;
  Image image;
  Camera camera;
  cv::Mat mask;
  using fields = Fields<&View::name, &View::image, &View::camera, &View::mask>;
};

/// Throws Error if the image is empty or if the sizes of image, camera and mask differ. The message names the view and
/// both sizes. Throws as check_camera() does, too.
void check_view(const View& view);

/// The point at which all views are aimed: it has the least sum of squared distances to their central rays. A central
/// ray is a camera's z axis, so cropping an image does not change it. Returns nothing for a single view, for rays
/// within about 2.6 degrees of each other, and if the point is not in front of every source. In these cases the cameras
/// do not tell how far away the bone is.
std::optional<Eigen::Vector3d> meeting_point_mm(const List<View>& views);

/// The camera's axes as columns (u, v, viewing direction) in world coordinates: W = R_beta R_alpha R_0. The signs
/// follow DICOM's positioner angles (PS3.3 C.8.7.5): +beta (primary, left anterior oblique) moves the detector towards
/// the patient's left, +alpha (secondary, cranial) towards the head.
Eigen::Matrix3d world_from_camera_rotation(double alpha_rad, double beta_rad);

/// Geometry of an isocentric C-arm. The principal point is the centre of the image.
struct CArm {
  int width_px = 0, height_px = 0;
  Eigen::Vector2d pixel_mm = Eigen::Vector2d::Zero();  ///< width and height of a pixel on the detector
  double source_to_detector_mm = 0, source_to_isocentre_mm = 0;
  Eigen::Vector3d isocentre_mm = Eigen::Vector3d::Zero();
};

/// The camera whose axes are the columns of `world_from_camera`.
Camera carm_camera(const CArm& arm, const Eigen::Matrix3d& world_from_camera);

}  // namespace marrow
