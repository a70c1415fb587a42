// SPDX-License-Identifier: Apache-2.0
// Distance between the model's outline at a pose and the edges of the images. It needs no truth, so it can be used on
// real data.
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/plugin.hpp>
#include <vector>

#include "marrow/domain/quantile.hpp"

namespace {

using namespace marrow;

/// Finds the nearest edge pixel with a gradient of similar direction. Edge pixels are sorted into square cells. The
/// cells are visited in growing square rings around the point.
class EdgeSearch {
 public:
  explicit EdgeSearch(const EdgeMap& edges)
      : columns_(edges.width_px / kCell + 1),
        rows_(edges.height_px / kCell + 1),
        cells_(std::size_t(columns_) * rows_) {
    for (const EdgePixel& edge : edges.pixels) cells_[index(column(edge.u_px), row(edge.v_px))].push_back(edge);
  }

  /// The nearest edge within `reach_px` whose direction makes an angle of at most acos(least_cosine) with the unit
  /// vector (normal_u, normal_v). nullptr if there is none.
  const EdgePixel* nearest(double u, double v, double normal_u, double normal_v, double reach_px,
                           double least_cosine) const {
    double best = reach_px;
    const EdgePixel* found = nullptr;
    const int centre_column = column(u), centre_row = row(v);
    // The point may lie anywhere in its cell, so no edge in ring k is nearer than (k - 1) cells.
    for (int ring = 0; (ring - 1) * kCell <= best && ring <= std::max(columns_, rows_); ++ring)
      for (int y = centre_row - ring; y <= centre_row + ring; ++y) {
        const bool whole_row = y == centre_row - ring || y == centre_row + ring;
        for (int x = centre_column - ring; x <= centre_column + ring; x += whole_row || ring == 0 ? 1 : 2 * ring) {
          if (x < 0 || y < 0 || x >= columns_ || y >= rows_) continue;
          for (const EdgePixel& edge : cells_[index(x, y)]) {
            if (!(edge.direction_u * normal_u + edge.direction_v * normal_v >= least_cosine)) continue;
            const double distance = std::hypot(edge.u_px - u, edge.v_px - v);
            if (!(distance <= best)) continue;
            best = distance;
            found = &edge;
          }
        }
      }
    return found;
  }

 private:
  static constexpr int kCell = 16;
  std::size_t index(int column, int row) const { return std::size_t(row) * columns_ + column; }
  int column(double u) const { return std::clamp(int(u) / kCell, 0, columns_ - 1); }
  int row(double v) const { return std::clamp(int(v) / kCell, 0, rows_ - 1); }

  int columns_, rows_;
  std::vector<std::vector<EdgePixel>> cells_;
};

struct Options {
  double contour_spacing_px = 1;
  double reach_px = 30;
  double direction_tolerance_deg = 30;
};

/// The distances of a view's outline points. A point without an edge in reach counts with the reach itself. So parts of
/// the outline without a match make the figures worse, not better.
struct Distances {
  std::vector<double> px, mm;
  std::vector<double> across_px;  ///< of matched points: along the outline's normal, positive if the edge is outside
};

void check_edges(const View& view, const EdgeMap* edges) {
  check_view(view);
  const std::string what = "view '" + view.name + "'";
  if (!edges) throw Error(what + ": there is no edge map of that name; make the edges from the same list of views");
  if (edges->width_px != view.camera.width_px || edges->height_px != view.camera.height_px)
    throw Error(formatted("{}: the edge map is for {} x {} pixels, the image has {} x {}", what, edges->width_px,
                          edges->height_px, view.camera.width_px, view.camera.height_px));
  if (edges->pixels.empty())
    throw Error(what +
                ": the edge map is empty, so there is nothing to measure to; lower the edge detector's thresholds");
}

bool in_mask(const View& view, const OutlinePoint& point) {
  if (view.mask.empty()) return true;
  const int u = std::clamp(int(std::lround(point.u_px)), 0, view.mask.cols - 1);
  const int v = std::clamp(int(std::lround(point.v_px)), 0, view.mask.rows - 1);
  return view.mask.at<unsigned char>(v, u) != 0;
}

Distances measure(const RigidTransform& world_from_model, const OutlineProjector& projector, const View& view,
                  const EdgeMap& edges, const Options& options) {
  const EdgeSearch search(edges);
  const double least_cosine = std::cos(radians(options.direction_tolerance_deg));
  Distances distances;
  for (const OutlinePoint& point : projector.outline(view.camera, world_from_model, options.contour_spacing_px)) {
    if (!in_mask(view, point)) continue;
    const EdgePixel* edge =
        search.nearest(point.u_px, point.v_px, point.normal_u, point.normal_v, options.reach_px, least_cosine);
    const Eigen::Vector2d normal(point.normal_u, point.normal_v);
    Eigen::Vector2d off = options.reach_px * normal;
    if (edge) {
      off = Eigen::Vector2d(double(edge->u_px) - point.u_px, double(edge->v_px) - point.v_px);
      distances.across_px.push_back(off.dot(normal));
    }
    const Eigen::Vector3d world_mm = world_from_model * point.model_mm.cast<double>();
    distances.px.push_back(edge ? std::hypot(off.x(), off.y()) : options.reach_px);
    distances.mm.push_back(offset_at_mm(view.camera, world_mm, off).norm());
  }
  return distances;
}

void report(const std::string& prefix, const Distances& distances, Metrics& metrics) {
  const auto add = [&](const char* name, double value, const char* unit) {
    metrics.items.push_back({prefix + name, value, unit});
  };
  add("median_px", quantile(distances.px, 0.5), "px");
  add("p90_px", quantile(distances.px, 0.9), "px");
  add("median_mm", quantile(distances.mm, 0.5), "mm");
  add("p90_mm", quantile(distances.mm, 0.9), "mm");
  add("matched_percent", 100.0 * double(distances.across_px.size()) / double(distances.px.size()), "%");
  if (distances.across_px.empty()) return;
  const double offset_px = quantile(distances.across_px, 0.5);
  std::vector<double> spread_px;
  for (const double across : distances.across_px) spread_px.push_back(std::abs(across - offset_px));
  add("offset_px", offset_px, "px");
  add("spread_px", quantile(spread_px, 0.5), "px");
}

Metrics outline_distance(const Pose& pose, const OutlineProjector& projector, const List<View>& views,
                         const List<EdgeMap>& edges, const Options& options, Context& context) {
  check_pose(pose, "pose");
  Metrics per_view;
  Distances all;
  for (std::size_t i = 0; i < views.size(); ++i) {
    context.check_cancelled();
    const EdgeMap* of_view = edges.find(views.name(i));
    check_edges(views[i], of_view);
    const Distances distances = measure(pose.world_from_model, projector, views[i], *of_view, options);
    if (distances.px.empty()) {
      context.warn("view '" + views[i].name +
                   "': no part of the outline is inside the image at this pose; the view is left out");
      continue;
    }
    report(views[i].name + "_", distances, per_view);
    all.px.insert(all.px.end(), distances.px.begin(), distances.px.end());
    all.mm.insert(all.mm.end(), distances.mm.begin(), distances.mm.end());
    all.across_px.insert(all.across_px.end(), distances.across_px.begin(), distances.across_px.end());
  }
  if (all.px.empty())
    throw Error(
        formatted("the outline is outside the image in every view ({}), so there is no distance; check the pose and "
                  "that the cameras and the model use the same world frame",
                  views.size()));
  Metrics metrics;
  report("", all, metrics);
  metrics.items.insert(metrics.items.end(), per_view.items.begin(), per_view.items.end());
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.outline_distance", outline_distance)
      .summary(
          "Distance of the model's outline at a pose to the nearest image edges of similar direction; needs no truth")
      .in("pose", "pose to evaluate")
      .in("projector", "projector that gives the outline")
      .in("views", "X-ray views", over("view"))
      .in("edges", "edges of the views", over("view"))
      .out("metrics",
           "median and 90th percentile of the distance, in pixels and in mm at the object; the share of the outline "
           "with an edge in reach; the median offset of the edges along the outline's normal (positive: outside), "
           "caused by blur or by a model that is too thick or too thin; the median deviation from this offset. First "
           "for all views together, then for each view")
      .figures({"median_px", "p90_px", "median_mm", "p90_mm", "matched_percent", "offset_px", "spread_px",
                "*_median_px", "*_p90_px", "*_median_mm", "*_p90_mm", "*_matched_percent", "*_offset_px",
                "*_spread_px"})
      .option("contour_spacing_px", &Options::contour_spacing_px, "distance between two outline points", at_least(0.1),
              at_most(100))
      .option("reach_px", &Options::reach_px,
              "largest distance of an edge; outline points without an edge count with this distance", at_least(1),
              at_most(10000))
      .option("direction_tolerance_deg", &Options::direction_tolerance_deg,
              "largest angle between the outline's normal and an edge's gradient", at_least(0), at_most(180));
}
