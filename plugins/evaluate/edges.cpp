// SPDX-License-Identifier: Apache-2.0
// Edges of an extractor against the exact borders of a simulated image: how many are false alarms, how much of the
// borders is missed, and how far beside a border the right ones lie.
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/plugin.hpp>

#include "marrow/domain/quantile.hpp"

namespace {

using namespace marrow;

struct Options {
  double within_px = 3;
};

Eigen::Vector2d place_of(const EdgePixel& edge) { return {edge.u_px, edge.v_px}; }

/// The nearest of some edges, and how far it is; null and infinity if there are none.
struct Nearest {
  const EdgePixel* edge = nullptr;
  double distance_px = std::numeric_limits<double>::infinity();
};

Nearest nearest(const EdgePixel& to, const EdgeMap& edges) {
  Nearest found;
  for (const EdgePixel& edge : edges.pixels) {
    const double distance_px = (place_of(edge) - place_of(to)).norm();
    if (distance_px < found.distance_px) found = {&edge, distance_px};
  }
  return found;
}

Metrics edges(const EdgeMap& found, const EdgeMap& truth, const Options& options) {
  if (found.width_px != truth.width_px || found.height_px != truth.height_px)
    throw Error(
        formatted("the edges are of an image of {} x {} pixels, but the true borders of one of {} x {}; compare edges "
                  "of the same view",
                  found.width_px, found.height_px, truth.width_px, truth.height_px));
  if (truth.pixels.empty()) throw Error("the image shows no true border, so there is nothing to compare");
  std::vector<double> across_px;
  for (const EdgePixel& edge : found.pixels) {
    const Nearest border = nearest(edge, truth);
    if (border.distance_px > options.within_px) continue;
    const Eigen::Vector2d normal(border.edge->direction_u, border.edge->direction_v);
    across_px.push_back(std::abs(normal.dot(place_of(edge) - place_of(*border.edge))));
  }
  const auto missed = std::count_if(truth.pixels.begin(), truth.pixels.end(), [&](const EdgePixel& border) {
    return nearest(border, found).distance_px > options.within_px;
  });
  const double none = std::numeric_limits<double>::quiet_NaN(), count = double(found.pixels.size());
  Metrics metrics;
  metrics.items = {{"edges", count, ""},
                   {"false_alarms", count > 0 ? 1 - double(across_px.size()) / count : none, ""},
                   {"missed", double(missed) / double(truth.pixels.size()), ""},
                   {"offset_px", across_px.empty() ? none : quantile(across_px, 0.5), "px"}};
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.edges", edges)
      .summary("Edges against the exact borders in an image: false alarms, what is missed, and the offset of the rest")
      .in("edges", "edges that an extractor found")
      .in("truth", "exact borders in the same image, as evaluate.true_edges gives them")
      .out("metrics",
           "edges: their number; false_alarms: the share of them that is near no border; missed: the share of the "
           "borders that is near no edge; offset_px: median distance of the others from the border, across it")
      .figures({"edges", "false_alarms", "missed", "offset_px"})
      .option("within_px", &Options::within_px, "this near to a border, an edge is right", at_least(0.5), at_most(100));
}
