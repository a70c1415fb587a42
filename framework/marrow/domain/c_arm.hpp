// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Geometry>

#include "marrow/base/export.hpp"
#include "marrow/domain/camera.hpp"

namespace MARROW_EXPORT marrow {

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
