// SPDX-License-Identifier: Apache-2.0
// By how much the edges of each view lie beside the model's outline, and in which direction. At a pose that fits, the
// distances r from outline to edges along the normals n scatter about 0. What a camera or the edge extractor does to a
// whole image stays: r = across + n . shift, solved by least squares with Tukey's weights (Holland and Welsch,
// Communications in Statistics 6, 1977).
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/match/inputs.hpp"
#include "marrow/toolbox/match/nearest_edges.hpp"

namespace {

using namespace marrow;

struct Options {
  double contour_spacing_px = 2;
  double reach_px = 6;
  double direction_tolerance_deg = 40;
  std::string polarity = "brighter_outside";
};

/// The distance of the nearest edge from a point of the outline, along the outline's normal.
struct Residual {
  double normal_u, normal_v, along_normal_px;
};

std::vector<Residual> residuals_of(const std::vector<OutlinePoint>& outline, const match::NearestEdges& edges,
                                   const Options& options) {
  std::vector<Residual> residuals;
  for (const OutlinePoint& p : outline) {
    double best_px = options.reach_px;
    std::optional<double> along_normal_px;
    for (const float sign : {1.0f, -1.0f}) {
      if (sign < 0 && options.polarity != "either") break;
      const EdgePixel* edge = edges.find(p.u_px, p.v_px, sign * p.normal_u, sign * p.normal_v);
      if (!edge) continue;
      const double u = double(edge->u_px) - double(p.u_px), v = double(edge->v_px) - double(p.v_px);
      if (std::hypot(u, v) >= best_px) continue;
      best_px = std::hypot(u, v);
      along_normal_px = u * double(p.normal_u) + v * double(p.normal_v);
    }
    if (along_normal_px) residuals.push_back({double(p.normal_u), double(p.normal_v), *along_normal_px});
  }
  return residuals;
}

/// across, shift_u and shift_v in px, and the median distance that remains.
struct Offset {
  Eigen::Vector3d px = Eigen::Vector3d::Zero();
  double rest_px = 0;
};

std::optional<Offset> offset_of(const std::vector<Residual>& residuals) {
  constexpr int kRounds = 20;
  constexpr double kTukey = 4.685, kDeviationsAMedian = 1.4826, kLeast_px = 0.05;
  Offset offset;
  std::vector<double> rest(residuals.size());
  for (int round = 0; round <= kRounds; ++round) {
    for (std::size_t i = 0; i < residuals.size(); ++i)
      rest[i] = residuals[i].along_normal_px -
                offset.px.dot(Eigen::Vector3d(1, residuals[i].normal_u, residuals[i].normal_v));
    std::vector<double> sizes;
    for (const double one : rest) sizes.push_back(std::abs(one));
    offset.rest_px = quantile(sizes, 0.5);
    if (round == kRounds) break;
    const double scale = kTukey * std::max(kLeast_px, kDeviationsAMedian * offset.rest_px);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const double part = rest[i] / scale, weight = std::abs(part) < 1 ? (1 - part * part) * (1 - part * part) : 0;
      const Eigen::Vector3d row(1, residuals[i].normal_u, residuals[i].normal_v);
      normal += weight * row * row.transpose();
      right += weight * residuals[i].along_normal_px * row;
    }
    // An outline with all normals to one side does not tell an offset across it from a shift.
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    if (!(solver.vectorD().minCoeff() > 1e-2 * solver.vectorD().maxCoeff())) return std::nullopt;
    offset.px = solver.solve(right);
  }
  return offset;
}

Metrics outline_offset(const Pose& pose, const OutlineProjector& projector, const List<View>& views,
                       const List<EdgeMap>& edges, const Options& options, Context& context) {
  constexpr std::size_t kLeastPoints = 20;
  check_pose(pose, "pose");
  match::check_edges(views, edges);
  Metrics metrics;
  for (std::size_t i = 0; i < views.size(); ++i) {
    context.check_cancelled();
    const View& view = views[i];
    const match::NearestEdges nearest(edges[i], view.mask, radians(options.direction_tolerance_deg));
    const std::vector<Residual> residuals = residuals_of(
        projector.outline(view.camera, pose.world_from_model, options.contour_spacing_px), nearest, options);
    if (residuals.size() < kLeastPoints)
      throw Error(
          formatted("view '{}': only {} points of the outline have an edge within {:g} px, and {} are needed; check "
                    "the pose, or raise reach_px",
                    view.name, residuals.size(), options.reach_px, kLeastPoints));
    const std::optional<Offset> offset = offset_of(residuals);
    if (!offset)
      throw Error("view '" + view.name +
                  "': all of the outline runs in one direction, which does not tell an offset across it from a shift; "
                  "leave this view out");
    const std::array<std::pair<const char*, double>, 4> figures{{{"_across_px", offset->px[0]},
                                                                 {"_shift_u_px", offset->px[1]},
                                                                 {"_shift_v_px", offset->px[2]},
                                                                 {"_scatter_px", offset->rest_px}}};
    for (const auto& [name, value] : figures) metrics.items.push_back({view.name + name, value, "px"});
  }
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.outline_offset", outline_offset)
      .summary(
          "By how much the edges of each view lie beside the model's outline: across it, and as a shift of the whole "
          "image. It needs no truth; evaluate.common_offset says what all frames have in common")
      .in("pose", "pose found")
      .in("projector", "draws the model's outline")
      .in("views", "X-ray views", over("view"))
      .in("edges", "edges of the views", over("view"))
      .out("metrics",
           "of each view: the offset of the edges across the outline, positive if they lie outside; the shift of the "
           "edges along the image's columns and rows; the median distance that remains")
      .figures({"*_across_px", "*_shift_u_px", "*_shift_v_px", "*_scatter_px"})
      .option("contour_spacing_px", &Options::contour_spacing_px, "distance between two points of the outline",
              at_least(0.25), at_most(100))
      .option("reach_px", &Options::reach_px, "a point with no edge within this distance does not count", at_least(0.5),
              at_most(100))
      .option("direction_tolerance_deg", &Options::direction_tolerance_deg,
              "largest angle between the directions of edge and outline", at_least(10), at_most(180))
      .option("polarity", &Options::polarity,
              "brighter_outside: edges count where the image is brighter outside the model; either: where it is "
              "darker, too",
              one_of({"brighter_outside", "either"}));
}
