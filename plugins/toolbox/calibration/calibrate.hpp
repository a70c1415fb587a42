// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calibration from views of a board with known points (Tsai, IEEE J. Robotics and Automation 1987). It starts from a
// closed form that does not depend on the radial distortion. Then it minimises the reprojection error over all views
// and parameters.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/calibration.hpp"

namespace marrow::calibration {

/// The points of one view: positions on the board and in the image as taken (not undistorted), in the same order.
struct ViewPoints {
  std::string name;
  std::vector<Eigen::Vector3d> board_mm;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<int> beads;  ///< their indices on the board
};

/// The parameters that are estimated in addition to the focal length and the poses.
struct CalibrationModel {
  int radial_terms = 2;  ///< 0 to 3
  bool square_pixels = false;
  bool principal_point = true;  ///< false: fixed at the middle of the image
};

struct CalibratedView {
  RigidTransform camera_from_world{"camera", "world"};  ///< the board's frame is the world
  /// One standard deviation of a small rotation [rad] and translation [mm] about and along the axes of the camera's
  /// frame.
  Vector6d deviation = Vector6d::Zero();
  std::vector<Eigen::Vector2d> residuals_px;  ///< seen minus predicted, in the order of the view's points
};

struct CalibrationResult {
  Calibration calibration;
  std::vector<CalibratedView> views;
};

struct ClosedForm {
  double focal_px = 0;
  bool is_mirrored = false;  ///< only a mirrored image explains the points; then the pose is useless
  RigidTransform camera_from_world{"camera", "world"};
};
/// A camera by Tsai's closed form from one view. The points must not lie in one plane. The principal point is assumed
/// at the middle of the image. std::nullopt if there are fewer than 8 points or they do not determine a camera.
std::optional<ClosedForm> closed_form_camera(const ViewPoints& view, const Eigen::Vector2d& middle_px);

/// Adds the residuals, and one standard deviation of each parameter, to a calibration that is fitted to the views: from
/// the derivatives at the minimum and the size of the residuals. What nothing determines has a deviation that is huge,
/// or no number.
void add_deviations(const std::vector<ViewPoints>& views, const CalibrationModel& model, CalibrationResult& result);

/// Estimates the camera and the poses of all views. Throws Error if a view has fewer than 8 points, if the points do
/// not determine the parameters, or if the image is mirrored.
CalibrationResult calibrate(const std::vector<ViewPoints>& views, int width_px, int height_px,
                            const CalibrationModel& model);

/// The pixel of a board point in the image as taken, for a camera in this pose.
Eigen::Vector2d seen_at(const Calibration& calibration, const RigidTransform& camera_from_world,
                        const Eigen::Vector3d& board_mm);

}  // namespace marrow::calibration
