// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calibration from views of a board whose points are known (Tsai, IEEE J. Robotics and Automation 1987): a closed-form
// start that does not depend on the radial distortion, then the reprojection error minimised over all views and
// parameters.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/calibration.hpp"

namespace marrow::calibration {

/// The points of one view: where they are on the board and in the image as taken.
struct ViewPoints {
  std::string name;
  std::vector<Eigen::Vector3d> board_mm;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<int> beads;  ///< their indices on the board
};

/// What is estimated beside focal length and poses.
struct CalibrationModel {
  int radial_terms = 2;  ///< 0 to 3
  bool square_pixels = false;
  bool principal_point = true;  ///< false: it stays in the middle of the image
};

struct CalibratedView {
  RigidTransform camera_from_world{"camera", "world"};  ///< the board is the world
  /// One standard deviation of a small rotation [rad] and translation [mm] of the camera's frame, about and along its
  /// axes.
  Vector6d deviation = Vector6d::Zero();
  std::vector<Eigen::Vector2d> residuals_px;  ///< seen minus predicted
};

struct CalibrationResult {
  Calibration calibration;
  std::vector<CalibratedView> views;
};

/// A camera by Tsai's closed form from one view of points that do not lie in one plane, the principal point taken to be
/// the middle of the image. No value where the points do not determine it.
struct ClosedForm {
  double focal_px = 0;
  bool is_mirrored = false;  ///< only a mirrored image explains the points; the pose is then of no use
  RigidTransform camera_from_world{"camera", "world"};
};
std::optional<ClosedForm> closed_form_camera(const ViewPoints& view, const Eigen::Vector2d& middle_px);

/// Throws Error where the points do not determine the parameters or the image is mirrored.
CalibrationResult calibrate(const std::vector<ViewPoints>& views, int width_px, int height_px,
                            const CalibrationModel& model);

/// Where a board point is seen in the image as taken, by a camera in this pose.
Eigen::Vector2d seen_at(const Calibration& calibration, const RigidTransform& camera_from_world,
                        const Eigen::Vector3d& board_mm);

}  // namespace marrow::calibration
