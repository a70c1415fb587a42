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
    row.normal_u = double(p.normal_u), row.normal_v = double(p.normal_v);
    row.from_middle_u = double(p.u_px) - k(0, 2), row.from_middle_v = double(p.v_px) - k(1, 2);
    row.in_camera_mm = seen, row.by_camera_px_per_mm = by_camera.transpose();
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

std::optional<Matrix6d> covariance_by_errors(const List<View>& views, const OutlineProjector& projector,
                                             const Pose& pose,
                                             const std::function<std::vector<OutlineError>(std::size_t view)>& errors) {
  std::vector<std::vector<OutlineRow>> of_views;
  Matrix7d normal = Matrix7d::Zero();
  for (const View& view : views) {
    of_views.push_back(rows_of(view, projector, pose));
    for (const OutlineRow& row : of_views.back())
      normal += row.by_unknowns * row.by_unknowns.transpose() / double(of_views.back().size());
  }
  const Eigen::LDLT<Matrix7d> solver(normal);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return std::nullopt;
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t v = 0; v < of_views.size(); ++v)
    for (const OutlineError& error : errors(v)) {
      Vector7d pulled = Vector7d::Zero();
      for (const OutlineRow& row : of_views[v])
        pulled += row.by_unknowns * error.moved_px(row) / double(of_views[v].size());
      const Vector6d motion = error.deviation * solver.solve(pulled).head<6>();
      covariance += motion * motion.transpose();
    }
  if (!covariance.allFinite()) return std::nullopt;
  return covariance;
}

}  // namespace marrow::deviations
