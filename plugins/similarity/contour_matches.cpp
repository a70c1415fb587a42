// SPDX-License-Identifier: Apache-2.0
#include "contour_matches.hpp"

#include <cmath>

#include "marrow/similarity/edge_loss.hpp"
#include "marrow/toolbox/match/nearest_outline.hpp"

namespace marrow::match {
namespace {

/// With either polarity, the nearer one of two edges: the one that is brighter outside, and the one that is darker
/// there.
const EdgePixel* nearest_edge(const NearestEdges& edges, const OutlinePoint& p, bool either_polarity) {
  const EdgePixel* edge = edges.find(p.u_px, p.v_px, p.normal_u, p.normal_v);
  if (!either_polarity) return edge;
  const EdgePixel* other = edges.find(p.u_px, p.v_px, -p.normal_u, -p.normal_v);
  if (!edge || !other) return edge ? edge : other;
  const auto distance2 = [&](const EdgePixel& e) {
    return (e.u_px - p.u_px) * (e.u_px - p.u_px) + (e.v_px - p.v_px) * (e.v_px - p.v_px);
  };
  return distance2(*other) < distance2(*edge) ? other : edge;
}

Residual residual(const OutlinePoint& p, const EdgePixel& edge) {
  const auto [across, beyond] = way_to_edge(edge.u_px - p.u_px, edge.v_px - p.v_px, p.normal_u, p.normal_v);
  return {across, beyond, p.u_px, p.v_px, p.normal_u, p.normal_v, p.model_mm};
}

std::vector<Residual> match_edges(const Camera& camera, const NearestEdges& edges,
                                  const std::vector<OutlinePoint>& outline, double level_reach_px,
                                  const ContourOptions& options) {
  const double reach_px =
      level_reach_px + (options.estimate_offset ? kMostOffset_px : std::abs(options.edge_offset_px));
  const float least_cosine = float(std::cos(radians(options.direction_tolerance_deg)));
  const NearestOutline nearest(outline, camera.width_px, camera.height_px, reach_px);
  std::vector<Residual> residuals;
  for (const EdgePixel& edge : edges.all())
    if (const int point = nearest.find(edge, reach_px, least_cosine, options.polarity == "either"); point >= 0)
      residuals.push_back(residual(outline[std::size_t(point)], edge));
  return residuals;
}

}  // namespace

Matches matches_of(const View& view, const NearestEdges& edges, const std::vector<OutlinePoint>& outline,
                   double reach_px, const ContourOptions& options) {
  const bool either_polarity = options.polarity == "either";
  Matches matches;
  matches.residuals.reserve(outline.size());
  std::vector<OutlinePoint> compared;
  for (const OutlinePoint& p : outline) {
    if (!is_away_from_border(view.camera, p.u_px, p.v_px)) continue;
    matches.is_drawn = true;
    if (is_masked(view, p.u_px, p.v_px)) continue;
    if (options.symmetric) compared.push_back(p);
    if (const EdgePixel* edge = nearest_edge(edges, p, either_polarity))
      matches.residuals.push_back(residual(p, *edge));
    else
      matches.unmatched_px.emplace_back(p.u_px, p.v_px);
  }
  if (options.symmetric) matches.of_edges = match_edges(view.camera, edges, compared, reach_px, options);
  return matches;
}

}  // namespace marrow::match
