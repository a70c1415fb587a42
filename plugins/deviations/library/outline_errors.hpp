// SPDX-License-Identifier: Apache-2.0
#pragma once
// How errors that are alike all along an outline move a pose. Each moves the outline's points along their normals by
// delta; the pose that fits them best then moves by (J^T J)^-1 J^T delta (least squares, J: the points' motion by the
// pose). The costs estimate one offset common to all views, so this is one more unknown here.
#include <Eigen/Core>
#include <functional>
#include <marrow/plugin.hpp>
#include <optional>
#include <string>
#include <vector>

namespace marrow::deviations {

/// A point of an outline: how far a small motion in the pose's frame and a common offset move its residual, where it
/// lies, and how far a motion of the body by a mm along the camera's axes moves it along its normal.
struct OutlineRow {
  Eigen::Matrix<double, 7, 1> by_unknowns;
  OutlinePoint point;
  double normal_u, normal_v, from_middle_u, from_middle_v;
  Eigen::Vector3d in_camera_mm, by_camera_px_per_mm;
};

/// An error that moves the edges of a view along the outline's normals.
struct OutlineError {
  double deviation;
  std::function<double(const OutlineRow&)> moved_px;
};

/// How a pose follows the points of its outline in some views.
class OutlineFit {
 public:
  /// Nothing if the outline does not determine the pose.
  static std::optional<OutlineFit> of(const List<View>& views, const OutlineProjector& projector, const Pose& pose);

  /// The points of each view.
  const std::vector<std::vector<OutlineRow>>& rows() const { return rows_; }
  /// How the pose moves in its frame (r [rad], t [mm]) by a pixel's offset of each point of a view, one in each column.
  const Eigen::Matrix<double, 6, Eigen::Dynamic>& motions(std::size_t view) const { return motions_[view]; }
  /// How the pose moves by an error in one view.
  Vector6d motion(std::size_t view, const std::function<double(const OutlineRow&)>& moved_px) const;
  /// The covariance of the pose by the errors of all views, each independent of the others.
  Matrix6d covariance(const std::function<std::vector<OutlineError>(std::size_t view)>& errors) const;

 private:
  std::vector<std::vector<OutlineRow>> rows_;
  std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> motions_;
};

/// The poses of a search with wider deviations, and the last of them.
struct Widened {
  Pose pose;
  List<Pose> stages;
};
/// Adds to the covariance of each pose what `more` gives for it. A covariance that is absent or not finite stays. Where
/// `more` gives nothing, a warning says that the outline does not determine the pose, `so`. Throws Error if there is no
/// pose, or as check_pose() does.
Widened widened(const List<Pose>& stages, const std::function<std::optional<Matrix6d>(const Pose&)>& more,
                const std::string& so, Context& context);

}  // namespace marrow::deviations
