// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/c_arm.hpp"

namespace marrow {

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
