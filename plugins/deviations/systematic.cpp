// SPDX-License-Identifier: Apache-2.0
// Adds to a predicted covariance what the residuals of one frame cannot show, because it is alike all along an outline:
// the edges of an image lie beside the model's outline by an offset that differs from view to view and with the
// direction of the border, they lie inside where metal is thin, and the cameras are a little off. Each such error moves
// the outline's points along their normals by delta; the pose that fits them best then moves by (J^T J)^-1 J^T delta
// (least squares, J: the points' motion by the pose). The costs estimate one offset common to all views, so this is one
// more unknown here.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <marrow/plugin.hpp>

#include "metal_rims.hpp"

namespace {

using namespace marrow;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

struct Options {
  double offset_px = 0.3;
  double camera_px = 0.5;
  double camera_depth_percent = 0;
  double opaque_mm = 0;
  double blur_px = 2;
};

struct Result {
  Pose pose;
  List<Pose> stages;
};

/// A point of an outline, and how far a small motion in the pose's frame and a common offset move its residual.
struct Row {
  Vector7d by_unknowns;
  double normal_u, normal_v, from_middle_u, from_middle_v;
  double rim_px = 0;  ///< how far inside the outline metal of the given opacity shows its edge
};

std::vector<Row> rows_of(const View& view, const OutlineProjector& projector, const Mesh& model, const Pose& pose,
                         const Options& options) {
  std::optional<deviations::PathLengths> paths;
  if (options.opaque_mm > 0) paths.emplace(model, view.camera, pose.world_from_model);
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
    row.normal_u = double(p.normal_u), row.normal_v = double(p.normal_v);
    row.from_middle_u = double(p.u_px) - k(0, 2), row.from_middle_v = double(p.v_px) - k(1, 2);
    if (paths) row.rim_px = deviations::edge_inside_px(*paths, p, {options.opaque_mm, options.blur_px});
    rows.push_back(row);
  }
  return rows;
}

/// An error that moves the edges of a view along the outline's normals.
struct SystematicError {
  double deviation;
  std::function<double(const Row&)> moved_px;
  bool is_of_body = false;  ///< the same in all views; else each view has its own
};

/// The offset of the edges has a constant part and two that change with the border's direction, as those of upright and
/// level borders differ. Where the metal's opacity is unknown, its rims may be anything from opaque to as thin as
/// given. A camera shifts and scales the whole image.
std::vector<SystematicError> errors_of(const Options& options) {
  const double of_direction_px = options.offset_px / std::sqrt(2.0);
  const auto cos2 = [](const Row& r) { return r.normal_u * r.normal_u - r.normal_v * r.normal_v; };
  return {{options.offset_px, [](const Row&) { return 1.0; }},
          {of_direction_px, cos2},
          {of_direction_px, [](const Row& r) { return 2 * r.normal_u * r.normal_v; }},
          {1, [](const Row& r) { return r.rim_px; }, true},
          {options.camera_px, [](const Row& r) { return r.normal_u; }},
          {options.camera_px, [](const Row& r) { return r.normal_v; }},
          {0.01 * options.camera_depth_percent,
           [](const Row& r) { return r.normal_u * r.from_middle_u + r.normal_v * r.from_middle_v; }}};
}

/// The covariance of the pose that the errors of all views make, each independent of the others. Nothing if the outline
/// does not determine the pose.
std::optional<Matrix6d> covariance_of(const List<View>& views, const OutlineProjector& projector, const Pose& pose,
                                      const Mesh& model, const Options& options) {
  std::vector<std::vector<Row>> of_views;
  Matrix7d normal = Matrix7d::Zero();
  for (const View& view : views) {
    of_views.push_back(rows_of(view, projector, model, pose, options));
    for (const Row& row : of_views.back())
      normal += row.by_unknowns * row.by_unknowns.transpose() / double(of_views.back().size());
  }
  const Eigen::LDLT<Matrix7d> solver(normal);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return std::nullopt;
  Matrix6d covariance = Matrix6d::Zero();
  for (const SystematicError& error : errors_of(options)) {
    Vector7d of_body = Vector7d::Zero();
    const auto add = [&](const Vector7d& pulled) {
      const Vector6d motion = error.deviation * solver.solve(pulled).head<6>();
      covariance += motion * motion.transpose();
    };
    for (const std::vector<Row>& rows : of_views) {
      Vector7d pulled = Vector7d::Zero();
      for (const Row& row : rows) pulled += row.by_unknowns * error.moved_px(row) / double(rows.size());
      if (error.is_of_body)
        of_body += pulled;
      else
        add(pulled);
    }
    add(of_body);
  }
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
      if (const auto more = covariance_of(views, projector, pose, model, options))
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
          "differs from view to view, rims of metal that let radiation pass, and errors of the cameras")
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
      .option(
          "opaque_mm", &Options::opaque_mm,
          "for metal of unknown opacity: the path through it behind which 1 / e of the radiation may arrive, such as "
          "1.5 for steel and 5 for titanium. Edges then lie inside the outline where the path is short; a standard "
          "deviation. 0: it is opaque, or no metal",
          at_least(0), at_most(50))
      .option("blur_px", &Options::blur_px,
              "with opaque_mm: standard deviation of the blur by the X-ray device and the edge extractor together",
              at_least(0.2), at_most(20));
}
