// SPDX-License-Identifier: Apache-2.0
#include "marrow/deviations/outline_errors.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace marrow::deviations {
namespace {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

std::vector<OutlineRow> rows_of(const View& view, const OutlineProjector& projector, const Pose& pose) {
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

}  // namespace

std::optional<OutlineFit> OutlineFit::of(const List<View>& views, const OutlineProjector& projector, const Pose& pose) {
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

Vector6d OutlineFit::motion(std::size_t view, const std::function<double(const OutlineRow&)>& moved_px) const {
  Vector6d motion = Vector6d::Zero();
  for (std::size_t i = 0; i < rows_[view].size(); ++i)
    motion += moved_px(rows_[view][i]) * motions_[view].col(Eigen::Index(i));
  return motion;
}

Matrix6d OutlineFit::covariance(const std::function<std::vector<OutlineError>(std::size_t view)>& errors) const {
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t view = 0; view < rows_.size(); ++view)
    for (const OutlineError& error : errors(view)) {
      const Vector6d moved = error.deviation * motion(view, error.moved_px);
      covariance += moved * moved.transpose();
    }
  return covariance;
}

Widened widened(const List<Pose>& stages, const std::function<std::optional<Matrix6d>(const Pose&)>& more,
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

}  // namespace marrow::deviations
