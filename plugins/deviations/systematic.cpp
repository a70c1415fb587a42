// SPDX-License-Identifier: Apache-2.0
// Adds to a predicted covariance what the residuals of one frame cannot show, because it is alike all along an outline:
// the edges of an image lie beside the model's outline by an offset that differs from view to view and with the
// direction of the border, the model's surface is a little off, and so are the cameras. Each such error moves the
// outline's points along their normals by delta; the pose that fits them best then moves by (J^T J)^-1 J^T delta (least
// squares, J: the points' motion by the pose). The costs estimate one offset common to all views, so this is one more
// unknown here.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <marrow/plugin.hpp>

#include "marrow/base/number_text.hpp"

namespace {

using namespace marrow;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

struct Options {
  double offset_px = 0.3;
  double camera_px = 0.5;
  double camera_depth_percent = 0;
  double surface_mm = 0;
  double surface_reach_mm = 10;
};

struct Result {
  Pose pose;
  List<Pose> stages;
};

/// A point of an outline, and how far a small motion in the pose's frame and a common offset move its residual.
struct Row {
  Vector7d by_unknowns;
  Eigen::Vector3d on_bone_mm;
  double px_per_mm;  ///< how far it moves along its normal if the surface grows there
  double normal_u, normal_v, from_middle_u, from_middle_v;
};

std::vector<Row> rows_of(const View& view, const OutlineProjector& projector, const Pose& pose) {
  const RigidTransform camera_from_model = view.camera.camera_from_world * pose.world_from_model;
  const Eigen::Matrix3d& k = view.camera.intrinsics;
  std::vector<Row> rows;
  for (const OutlinePoint& p : projector.outline(view.camera, pose.world_from_model, 4)) {
    const Eigen::Vector3d point = p.model_mm.cast<double>(), seen = camera_from_model * point;
    const Eigen::RowVector3d by_camera = (double(p.normal_u) * (k.row(0) - double(p.u_px) * k.row(2)) +
                                          double(p.normal_v) * (k.row(1) - double(p.v_px) * k.row(2))) /
                                         seen.z();
    const Eigen::Vector3d by_point = (by_camera * camera_from_model.rotation).transpose();
    Row row;
    row.by_unknowns << pose.frame.axes.transpose() * (point - pose.frame.origin_mm).cross(by_point),
        pose.frame.axes.transpose() * by_point, 1;
    row.on_bone_mm = point, row.px_per_mm = by_point.norm();
    row.normal_u = double(p.normal_u), row.normal_v = double(p.normal_v);
    row.from_middle_u = double(p.u_px) - k(0, 2), row.from_middle_v = double(p.v_px) - k(1, 2);
    rows.push_back(row);
  }
  return rows;
}

/// An error that moves the edges of a view along the outline's normals.
struct SystematicError {
  double deviation;
  std::function<double(const Row&)> moved_px;
};

/// The offset of the edges has a constant part and two that change with the border's direction, as those of upright and
/// level borders differ. A camera shifts and scales the whole image.
std::vector<SystematicError> errors_of(const Options& options) {
  const double of_direction_px = options.offset_px / std::sqrt(2.0);
  const auto cos2 = [](const Row& r) { return r.normal_u * r.normal_u - r.normal_v * r.normal_v; };
  return {{options.offset_px, [](const Row&) { return 1.0; }},
          {of_direction_px, cos2},
          {of_direction_px, [](const Row& r) { return 2 * r.normal_u * r.normal_v; }},
          {options.camera_px, [](const Row& r) { return r.normal_u; }},
          {options.camera_px, [](const Row& r) { return r.normal_v; }},
          {0.01 * options.camera_depth_percent,
           [](const Row& r) { return r.normal_u * r.from_middle_u + r.normal_v * r.from_middle_v; }}};
}

/// The covariance of the pose that errors of the surface make. They belong to the bone, so all views see the same ones,
/// and they are alike where points are near each other: a Gaussian process over the surface (Rasmussen and Williams
/// 2006) with the squared exponential kernel. `motions`: how the pose moves by an offset of each point, in a column.
Matrix6d covariance_of_surface(const std::vector<Row>& rows, const Eigen::Matrix<double, 6, Eigen::Dynamic>& motions,
                               const Options& options) {
  const Eigen::Index count = Eigen::Index(rows.size());
  Eigen::MatrixXd alike(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Row &a = rows[std::size_t(i)], &b = rows[std::size_t(j)];
      const double apart = (a.on_bone_mm - b.on_bone_mm).norm() / options.surface_reach_mm;
      alike(i, j) = alike(j, i) = a.px_per_mm * b.px_per_mm * std::exp(-0.5 * apart * apart);
    }
  return options.surface_mm * options.surface_mm * (motions * alike * motions.transpose());
}

/// The covariance of the pose that the errors of all views make, each independent of the others. Nothing if the outline
/// does not determine the pose.
std::optional<Matrix6d> covariance_of(const List<View>& views, const OutlineProjector& projector, const Pose& pose,
                                      const Options& options) {
  std::vector<std::vector<Row>> of_views;
  Matrix7d normal = Matrix7d::Zero();
  for (const View& view : views) {
    of_views.push_back(rows_of(view, projector, pose));
    for (const Row& row : of_views.back())
      normal += row.by_unknowns * row.by_unknowns.transpose() / double(of_views.back().size());
  }
  const Eigen::LDLT<Matrix7d> solver(normal);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return std::nullopt;
  Matrix6d covariance = Matrix6d::Zero();
  std::vector<Row> all;
  for (const std::vector<Row>& rows : of_views) all.insert(all.end(), rows.begin(), rows.end());
  Eigen::Matrix<double, 6, Eigen::Dynamic> motions(6, Eigen::Index(all.size()));
  Eigen::Index column = 0;
  for (const std::vector<Row>& rows : of_views) {
    const Eigen::Index first = column;
    for (const Row& row : rows) motions.col(column++) = solver.solve(row.by_unknowns).head<6>() / double(rows.size());
    for (const SystematicError& error : errors_of(options)) {
      Vector6d motion = Vector6d::Zero();
      for (std::size_t i = 0; i < rows.size(); ++i)
        motion += error.deviation * error.moved_px(rows[i]) * motions.col(first + Eigen::Index(i));
      covariance += motion * motion.transpose();
    }
  }
  if (options.surface_mm > 0) covariance += covariance_of_surface(all, motions, options);
  if (!covariance.allFinite()) return std::nullopt;
  return covariance;
}

Result systematic(const List<Pose>& stages, const Mesh& model, const OutlineProjector& projector,
                  const List<View>& views, const Options& options, Context& context) {
  if (stages.empty()) throw Error("there is no pose; wire the stages of a registration");
  check_mesh(model, "model");
  Result result;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    check_pose(stages[i], "the pose of stage '" + stages.name(i) + "'");
    Pose pose = stages[i];
    if (pose.covariance && pose.covariance->allFinite()) {
      if (const auto more = covariance_of(views, projector, pose, options))
        *pose.covariance += *more;
      else
        context.warn("the outline of stage '" + stages.name(i) +
                     "' does not determine the pose, so its deviations are left as they are");
    }
    result.stages.add(stages.name(i), pose);
  }
  result.pose = result.stages[result.stages.size() - 1];
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("deviations.systematic", systematic)
      .summary(
          "Adds to predicted deviations what all of an outline has in common: an offset between edges and outline that "
          "differs from view to view, errors of the surface, and errors of the cameras")
      .in("stages", "poses of a search", over("stage"))
      .in("model", "surface of the bone or implant")
      .in("projector", "draws its outline")
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .out("pose", &Result::pose, "the last pose; a covariance that is absent or not finite stays as it is")
      .out("stages", &Result::stages, "all poses", over("stage"))
      .option(
          "offset_px", &Options::offset_px,
          "standard deviation of the offset of the edges in a view from the offset that all views share, and of its "
          "change with the border's direction",
          at_least(0), at_most(50))
      .option("camera_px", &Options::camera_px,
              "standard deviation of the place of a camera's whole image, along each of its sides: the residual of its "
              "calibration where the bone lies",
              at_least(0), at_most(100))
      .option("camera_depth_percent", &Options::camera_depth_percent,
              "standard deviation of a camera's magnification; in one view it is that of the depth", at_least(0),
              at_most(50), unit("%"))
      .option("surface_mm", &Options::surface_mm,
              "standard deviation of the distance between the model's surface and what the edges in the images show of "
              "it, which is the same in all views and frames: a part of the CT's voxel and of the images' blur",
              at_least(0), at_most(20))
      .option("surface_reach_mm", &Options::surface_reach_mm,
              "how far from each other on the surface such errors are alike: where this far apart, their correlation "
              "is 0.61",
              at_least(0.1), at_most(1000));
}
