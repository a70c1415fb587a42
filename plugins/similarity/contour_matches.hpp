// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which edge of an image belongs to which point of the model's outline.
#include <cmath>
#include <string>
#include <vector>

#include "marrow/similarity/edge_loss.hpp"
#include "marrow/toolbox/match/inputs.hpp"
#include "marrow/toolbox/match/nearest_edges.hpp"

namespace marrow::match {

/// Options of similarity.contour_distance; see the help texts there.
struct ContourOptions {
  double contour_spacing_px = 2;
  double reach_px = 6;
  double scale_px = 1;
  double direction_tolerance_deg = 40;
  std::string polarity = "brighter_outside";
  double edge_offset_px = 0;
  bool estimate_offset = true;
  bool x_ray = true;
  bool symmetric = false;
  double others_reach_px = kOthersReach_px;
  std::vector<double> weights;
};

/// The offset between outline and edges is estimated within this distance of the given one.
constexpr double kMostOffset_px = 3;

/// A point of the outline and its nearest edge.
struct Residual {
  float along_normal;  ///< signed distance along the normal, positive if the edge lies outside the outline
  float beyond;  ///< distance along the outline from the point to the end of the edge pixel; 0 on an edge without gaps
  float u, v;
  float normal_u, normal_v;
  Eigen::Vector3f model_mm;
};

struct Matches {
  std::vector<Residual> residuals;
  std::vector<Eigen::Vector2f> unmatched_px;  ///< points compared that have no edge
  std::size_t points() const { return residuals.size() + unmatched_px.size(); }
  std::vector<Residual> of_edges;  ///< from the edges near the outline to the outline; only if the cost is symmetric
  bool is_drawn = false;           ///< some of the outline lies in the image, maybe outside the mask
};

/// With either polarity, the nearer one of two edges: the one that is brighter outside, and the one that is darker
/// there.
inline const EdgePixel* nearest_edge(const NearestEdges& edges, const OutlinePoint& p, bool either_polarity) {
  const EdgePixel* edge = edges.find(p.u_px, p.v_px, p.normal_u, p.normal_v);
  if (!either_polarity) return edge;
  const EdgePixel* other = edges.find(p.u_px, p.v_px, -p.normal_u, -p.normal_v);
  if (!edge || !other) return edge ? edge : other;
  const auto distance2 = [&](const EdgePixel& e) {
    return (e.u_px - p.u_px) * (e.u_px - p.u_px) + (e.v_px - p.v_px) * (e.v_px - p.v_px);
  };
  return distance2(*other) < distance2(*edge) ? other : edge;
}

inline Residual residual(const OutlinePoint& p, const EdgePixel& edge) {
  const auto [across, beyond] = way_to_edge(edge.u_px - p.u_px, edge.v_px - p.v_px, p.normal_u, p.normal_v);
  return {across, beyond, p.u_px, p.v_px, p.normal_u, p.normal_v, p.model_mm};
}

inline std::vector<Residual> match_edges(const Camera& camera, const NearestEdges& edges,
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

/// Matches the points of an outline with the edges of a view. If the cost is symmetric, the edges within `reach_px` are
/// also matched with the points.
inline Matches matches_of(const View& view, const NearestEdges& edges, const std::vector<OutlinePoint>& outline,
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
