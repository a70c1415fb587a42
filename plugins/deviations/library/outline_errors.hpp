// SPDX-License-Identifier: Apache-2.0
#pragma once
// How errors that are alike all along an outline move a pose. Each moves the outline's points along their normals by
// delta; the pose that fits them best then moves by (J^T J)^-1 J^T delta (least squares, J: the points' motion by the
// pose). The costs estimate one offset common to all views, so this is one more unknown here.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
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

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

inline std::vector<OutlineRow> rows_of(const View& view, const OutlineProjector& projector, const Pose& pose) {
  const RigidTransform camera_from_model = view.camera.camera_from_world * pose.world_from_model;
  const Eigen::Matrix3d& k = view.camera.intrinsics;
  std::vector<OutlineRow> rows;
  for (const OutlinePoint& p : projector.outline(view.camera, pose.world_from_model, 4)) {
    const Eigen::Vector3d point = p.model_mm.cast<double>(), seen = camera_from_model * point;
    const Eigen::RowVector3d by_camera = (double(p.normal_u) * (k.row(0) - double(p.u_px) * k.row(2)) +
                                          double(p.normal_v) * (k.row(1) - double(p.v_px) * k.row(2))) /
                                         seen.z();
    const Eigen::Vector3d by_point = (by_camera * camera_from_model.rotation).transpose();
    OutlineRow row;
    row.by_unknowns << pose.frame.axes.transpose() * (point - pose.frame.origin_mm).cross(by_point),
        pose.frame.axes.transpose() * by_point, 1;
    row.point = p;
    row.normal_u = double(p.normal_u), row.normal_v = double(p.normal_v);
    row.from_middle_u = double(p.u_px) - k(0, 2), row.from_middle_v = double(p.v_px) - k(1, 2);
    row.in_camera_mm = seen, row.by_camera_px_per_mm = by_camera.transpose();
    rows.push_back(row);
  }
  return rows;
}

/// The poses of a search with wider deviations, and the last of them.
struct Widened {
  Pose pose;
  List<Pose> stages;
};
/// Adds to the covariance of each pose what `more` gives for it. A covariance that is absent or not finite stays. Where
/// `more` gives nothing, a warning says that the outline does not determine the pose, `so`. Throws Error if there is no
/// pose, or as check_pose() does.
inline Widened widened(const List<Pose>& stages, const std::function<std::optional<Matrix6d>(const Pose&)>& more,
                       const std::string& so, Context& context) {
  if (stages.empty()) throw Error("there is no pose; wire the stages of a registration");
  Widened result;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    check_pose(stages[i], "the pose of stage '" + stages.name(i) + "'");
    Pose pose = stages[i];
    if (pose.covariance && pose.covariance->allFinite()) {
      if (const auto covariance = more(pose))
        *pose.covariance += *covariance;
      else
        context.warn("the outline of stage '" + stages.name(i) + "' does not determine the pose, so " + so);
    }
    result.stages.add(stages.name(i), pose);
  }
  result.pose = result.stages[result.stages.size() - 1];
  return result;
}

inline std::optional<OutlineFit> OutlineFit::of(const List<View>& views, const OutlineProjector& projector,
                                                const Pose& pose) {
  OutlineFit fit;
  Matrix7d normal = Matrix7d::Zero();
  for (const View& view : views) {
    fit.rows_.push_back(rows_of(view, projector, pose));
    for (const OutlineRow& row : fit.rows_.back())
      normal += row.by_unknowns * row.by_unknowns.transpose() / double(fit.rows_.back().size());
  }
  const Eigen::LDLT<Matrix7d> solver(normal);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return std::nullopt;
  for (const std::vector<OutlineRow>& rows : fit.rows_) {
    auto& motions = fit.motions_.emplace_back(6, Eigen::Index(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i)
      motions.col(Eigen::Index(i)) = solver.solve(rows[i].by_unknowns).head<6>() / double(rows.size());
    if (!motions.allFinite()) return std::nullopt;
  }
  return fit;
}
inline Vector6d OutlineFit::motion(std::size_t view, const std::function<double(const OutlineRow&)>& moved_px) const {
  Vector6d motion = Vector6d::Zero();
  for (std::size_t i = 0; i < rows_[view].size(); ++i)
    motion += moved_px(rows_[view][i]) * motions_[view].col(Eigen::Index(i));
  return motion;
}
inline Matrix6d OutlineFit::covariance(const std::function<std::vector<OutlineError>(std::size_t view)>& errors) const {
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t view = 0; view < rows_.size(); ++view)
    for (const OutlineError& error : errors(view)) {
      const Vector6d moved = error.deviation * motion(view, error.moved_px);
      covariance += moved * moved.transpose();
    }
  return covariance;
}

}  // namespace marrow::deviations
