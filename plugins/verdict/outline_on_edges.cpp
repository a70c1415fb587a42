// SPDX-License-Identifier: Apache-2.0
// How the outline of a pose lies on the images' edges. Where the bone is right, nearly all of the outline has an edge,
// and on no part of it all edges lie to the same side.
#include <algorithm>
#include <array>
#include <cmath>

#include "judged.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/match/nearest_edges.hpp"

namespace marrow::verdict {
namespace {

constexpr double kSpacing_px = 2, kTolerance_deg = 40;
constexpr double kExplained_mm = 1, kReach_mm = 4;  ///< across the outline, at the bone
constexpr double kMostAlong_px = 3;                 ///< an edge further along belongs to other points
constexpr int kParts = 4;                           ///< along the bone, on each side
constexpr std::size_t kLeastPoints = 12;            ///< of a part

/// The fit in one view; at the end, the worst of all views.
struct Fit {
  double unexplained = 0;  ///< share of the outline without an edge
  double part_mm = 0;      ///< the largest median distance of a part from the whole view's
  double spread_mm = 0;    ///< median distance from the whole view's median
};

/// The position of an outline's point along the bone's long axis.
double along_mm(const Judged& judged, const OutlinePoint& point) {
  return (point.model_mm.cast<double>() - judged.frame.origin_mm).dot(judged.frame.axes.col(2));
}

/// The part of the outline: the position along the bone's long axis, and the side of the image.
std::size_t part_of(const Judged& judged, const OutlinePoint& point, double from_mm, double to_mm) {
  const double along = along_mm(judged, point);
  const int place = std::clamp(int((along - from_mm) / (to_mm - from_mm + 1e-9) * kParts), 0, kParts - 1);
  return std::size_t(2 * place + (point.normal_u > 0));
}

/// The part of an offset that points out of an outline: across it, in mm, because pixels may not be square.
double outwards(const Eigen::Vector2d& offset_mm, const Eigen::Vector2d& along_mm) {
  return (offset_mm.x() * along_mm.y() - offset_mm.y() * along_mm.x()) / along_mm.norm();
}

Fit in_view(const Judged& judged, const std::vector<OutlinePoint>& outline, const View& view, const EdgeMap& edges) {
  const match::NearestEdges nearest(edges, view.mask, radians(kTolerance_deg));
  double from_mm = std::numeric_limits<double>::infinity(), to_mm = -from_mm;
  for (const OutlinePoint& point : outline) {
    const double along = along_mm(judged, point);
    from_mm = std::min(from_mm, along);
    to_mm = std::max(to_mm, along);
  }
  std::vector<double> all_mm;
  std::array<std::vector<double>, std::size_t(2 * kParts)> of_part_mm;
  std::size_t unexplained = 0;
  for (const OutlinePoint& point : outline) {
    const EdgePixel* edge = nearest.find(point.u_px, point.v_px, point.normal_u, point.normal_v);
    if (!edge) {
      ++unexplained;
      continue;
    }
    const Eigen::Vector2d normal(point.normal_u, point.normal_v), along(-normal.y(), normal.x()),
        off(double(edge->u_px) - point.u_px, double(edge->v_px) - point.v_px);
    const Eigen::Vector3d world_mm = judged.pose.world_from_model * point.model_mm.cast<double>();
    const double across_mm =
        outwards(offset_at_mm(view.camera, world_mm, off), offset_at_mm(view.camera, world_mm, along));
    const double along_px = std::abs(off.dot(along));
    unexplained += std::abs(across_mm) > kExplained_mm || along_px > kMostAlong_px;
    if (std::abs(across_mm) > kReach_mm || along_px > kMostAlong_px) continue;
    all_mm.push_back(across_mm);
    of_part_mm[part_of(judged, point, from_mm, to_mm)].push_back(across_mm);
  }
  Fit result;
  result.unexplained = outline.empty() ? 1 : double(unexplained) / double(outline.size());
  if (all_mm.empty()) return {1, kReach_mm, kReach_mm};
  const double median_mm = quantile(all_mm, 0.5);
  for (const auto& part_mm : of_part_mm)
    if (part_mm.size() >= kLeastPoints)
      result.part_mm = std::max(result.part_mm, std::abs(quantile(part_mm, 0.5) - median_mm));
  for (double& one : all_mm) one = std::abs(one - median_mm);
  result.spread_mm = quantile(all_mm, 0.5);
  return result;
}

}  // namespace

Evidence outline_on_edges(const Judged& judged, const OutlineProjector& projector, const List<View>& views,
                          const List<EdgeMap>& edges) {
  Fit worst;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const EdgeMap* of_view = edges.find(views.name(i));
    if (!of_view)
      throw Error("view '" + views.name(i) +
                  "': there is no edge map of that name; make the edges from the same list of views");
    const Fit one = in_view(judged, projector.outline(views[i].camera, judged.pose.world_from_model, kSpacing_px),
                            views[i], *of_view);
    worst.unexplained = std::max(worst.unexplained, one.unexplained);
    worst.part_mm = std::max(worst.part_mm, one.part_mm);
    worst.spread_mm = std::max(worst.spread_mm, one.spread_mm);
  }
  return {{"unexplained", worst.unexplained, ""},
          {"outline_part_mm", worst.part_mm, "mm"},
          {"outline_spread_mm", worst.spread_mm, "mm"}};
}

}  // namespace marrow::verdict
