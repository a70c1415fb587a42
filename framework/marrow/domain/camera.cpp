// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/camera.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"

namespace marrow {
namespace {

constexpr int kLargestSide_px = 65536;

}  // namespace

Eigen::Vector2d project(const Camera& camera, const Eigen::Vector3d& world_mm) {
  const Eigen::Vector3d x = camera.camera_from_world * world_mm;
  if (!(x.z() > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return (camera.intrinsics * x).hnormalized();
}

Eigen::Vector3d source_position_mm(const Camera& camera) {
  return -(camera.camera_from_world.rotation.transpose() * camera.camera_from_world.translation_mm);
}

Eigen::Vector3d ray_direction(const Camera& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d in_camera = camera.intrinsics.inverse() * pixel.homogeneous();
  return (camera.camera_from_world.rotation.transpose() * in_camera).normalized();
}

Plane back_project_line(const Camera& camera, const Eigen::Vector3d& line) {
  const Eigen::Vector3d in_camera = camera.intrinsics.transpose() * line;
  Plane plane;
  plane.normal = (camera.camera_from_world.rotation.transpose() * in_camera).normalized();
  plane.offset_mm = plane.normal.dot(source_position_mm(camera));
  return plane;
}

Eigen::Vector2d offset_at_mm(const Camera& camera, const Eigen::Vector3d& world_mm, const Eigen::Vector2d& offset_px) {
  const double depth = (camera.camera_from_world * world_mm).z();
  const Eigen::Matrix3d& k = camera.intrinsics;
  const double y = offset_px.y() / k(1, 1), x = (offset_px.x() - k(0, 1) * y) / k(0, 0);
  return {depth * x, depth * y};
}

double pixel_size_at_mm(const Camera& camera, const Eigen::Vector3d& world_mm) {
  const double depth = (camera.camera_from_world * world_mm).z();
  return depth / std::sqrt(camera.intrinsics(0, 0) * camera.intrinsics(1, 1));
}

void check_camera(const Camera& camera, const std::string& what) {
  if (camera.width_px <= 0 || camera.height_px <= 0)
    throw Error(formatted("{}: image size {} x {} pixels is not positive", what, camera.width_px, camera.height_px));
  if (camera.width_px > kLargestSide_px || camera.height_px > kLargestSide_px)
    throw Error(formatted("{}: image size {} x {} pixels; expected at most {} each way", what, camera.width_px,
                          camera.height_px, kLargestSide_px));
  if (!camera.intrinsics.allFinite() || !(camera.intrinsics(0, 0) > 0) || !(camera.intrinsics(1, 1) > 0))
    throw Error(what + ": the camera matrix needs positive focal lengths in its first two diagonal places");
  if (camera.intrinsics(1, 0) != 0 || camera.intrinsics.row(2) != Eigen::RowVector3d(0, 0, 1))
    throw Error(what + ": the camera matrix is not [f_u s u_0; 0 f_v v_0; 0 0 1], row by row" +
                (camera.intrinsics(2, 0) != 0 || camera.intrinsics(2, 1) != 0 ? "; it looks transposed" : ""));
  check_rigid(camera.camera_from_world, what);
}

void check_view(const View& view) {
  const auto size = [](int width, int height) { return formatted("{} x {}", width, height); };
  const std::string what = "view '" + view.name + "'";
  if (view.image.pixels.empty()) throw Error(what + ": the image is empty");
  check_camera(view.camera, what);
  if (view.image.width() != view.camera.width_px || view.image.height() != view.camera.height_px)
    throw Error(what + ": the image has " + size(view.image.width(), view.image.height()) +
                " pixels, but its camera is for " + size(view.camera.width_px, view.camera.height_px) +
                "; give the camera that belongs to this image");
  if (!view.mask.empty() && (view.mask.cols != view.image.width() || view.mask.rows != view.image.height()))
    throw Error(what + ": the mask has " + size(view.mask.cols, view.mask.rows) + " pixels, the image " +
                size(view.image.width(), view.image.height()));
}

std::optional<Eigen::Vector3d> meeting_point_mm(const List<View>& views) {
  constexpr double kLeastParallax = 1e-3;  // for two rays, twice the squared sine of half their angle
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const View& view : views) {
    const Eigen::Vector3d ray = view.camera.camera_from_world.rotation.row(2).transpose();
    const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    across += off;
    sum += off * source_position_mm(view.camera);
  }
  if (views.empty() || eigen_of_symmetric(across).values[0] < kLeastParallax) return std::nullopt;
  const Eigen::Vector3d point = solve_symmetric(across, sum);
  for (const View& view : views)
    if (!((view.camera.camera_from_world * point).z() > 0)) return std::nullopt;
  return point;
}

Eigen::Matrix3d world_from_camera_rotation(double alpha_rad, double beta_rad) {
  // At (0, 0) the detector is in front of the chest and the rays run along -y. The head is up in the image, so v runs
  // along -z. The image is seen from the source, so u runs to the patient's right.
  Eigen::Matrix3d r_0;
  r_0.col(0) = -Eigen::Vector3d::UnitX();
  r_0.col(1) = -Eigen::Vector3d::UnitZ();
  r_0.col(2) = -Eigen::Vector3d::UnitY();
  const Eigen::AngleAxisd r_alpha(-alpha_rad, Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd r_beta(beta_rad, Eigen::Vector3d::UnitZ());
  return r_beta.toRotationMatrix() * r_alpha.toRotationMatrix() * r_0;
}

Camera carm_camera(const CArm& arm, const Eigen::Matrix3d& world_from_camera) {
  Camera camera;
  camera.width_px = arm.width_px;
  camera.height_px = arm.height_px;
  // Integer coordinates are pixel centres. So the centre of the image is at (width - 1) / 2, not at width / 2.
  camera.intrinsics << arm.source_to_detector_mm / arm.pixel_mm.x(), 0, (arm.width_px - 1) / 2.0, 0,
      arm.source_to_detector_mm / arm.pixel_mm.y(), (arm.height_px - 1) / 2.0, 0, 0, 1;
  const Eigen::Vector3d source_mm = arm.isocentre_mm - arm.source_to_isocentre_mm * world_from_camera.col(2);
  camera.camera_from_world.rotation = world_from_camera.transpose();
  camera.camera_from_world.translation_mm = -(world_from_camera.transpose() * source_mm);
  return camera;
}

}  // namespace marrow
