// SPDX-License-Identifier: Apache-2.0
#pragma once
// What costs are given: views, their edges and weights, and other fragments that the same images show.
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "marrow/plugin.hpp"

namespace marrow::match {

/// Throws Error for no views, or one of which image and camera are none or do not suit each other.
void check_views(const List<View>& views);
/// Throws Error unless there are none, or one for each view, not below 0 and not all 0.
void check_weights(const std::vector<double>& weights, std::size_t views);
/// Throws Error unless there are edges of each view, as large as its camera says.
void check_edges(const List<View>& views, const List<EdgeMap>& edges);

/// The mean over views by their weights; without weights, of all the same.
double weighted_mean(const std::vector<double>& of_view, const std::vector<double>& weights);
inline double weight_of(const std::vector<double>& weights, std::size_t view) {
  return weights.empty() ? 1 : weights[view];
}

/// Another fragment where it is known to be, drawn in one way or the other.
struct Other {
  std::variant<const OutlineProjector*, const RadiographProjector*> projector;
  RigidTransform world_from_model;
};
/// The same, drawn as an outline.
struct OtherOutline {
  const OutlineProjector* projector;
  RigidTransform world_from_model;
};
template <class Projector>
using OtherDrawnBy = std::conditional_t<std::is_same_v<Projector, OutlineProjector>, OtherOutline, Other>;

/// Of lists over the fragments, all but the one that `own` draws: it is the same object. Throws Error for a fragment
/// without a pose, and for others without `own`, which is the node's input `own_port`.
template <class Projector>
std::vector<OtherDrawnBy<Projector>> others_of(const Projector* own, const List<Pose>* poses,
                                               const List<Projector>* projectors,
                                               const std::string& own_port = "projector");
/// The same, and the fragments that `outlines` draw; none of these is this one.
std::vector<Other> shadows_of(const RadiographProjector* own, const List<Pose>* poses,
                              const List<RadiographProjector>* projectors, const List<OutlineProjector>* outlines);

/// The views with masks that leave the others out: where their radiographs are above 0, or inside their outlines.
List<View> without_shadows(const List<View>& views, const std::vector<Other>& others);
constexpr double kOthersReach_px = 3;  ///< edges as near as this to another fragment's outline are its own
/// The edges but for those within `reach_px` of another's outline that have its direction, up to the tolerance.
List<EdgeMap> without_outlines(const List<View>& views, const List<EdgeMap>& edges,
                               const std::vector<OtherOutline>& others, double reach_px, double tolerance_deg);

}  // namespace marrow::match
