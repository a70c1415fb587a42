// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which edge of an image belongs to which point of the model's outline.
#include <string>
#include <vector>

#include "marrow/domain/functions.hpp"
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

/// Matches the points of an outline with the edges of a view. If the cost is symmetric, the edges within `reach_px` are
/// also matched with the points.
Matches matches_of(const View& view, const NearestEdges& edges, const std::vector<OutlinePoint>& outline,
                   double reach_px, const ContourOptions& options);

}  // namespace marrow::match
