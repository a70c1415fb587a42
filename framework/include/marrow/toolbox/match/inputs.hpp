// SPDX-License-Identifier: Apache-2.0
#pragma once
// What costs are given: views, their edges and weights, and other fragments that the same images show.
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

/// Other fragments where they are known to be.
struct Other {
  const Projector* projector;
  RigidTransform world_from_model;
};
/// Of lists over the fragments, all but the one that `own` draws: it is the same object. Throws Error for a fragment
/// without a pose, and for others without `own`.
std::vector<Other> others_of(const Projector* own, const List<Pose>* poses, const List<Projector>* projectors);

/// The views with masks that leave the others out: where their radiographs are above 0, or inside their outlines where
/// they are drawn as outlines only.
List<View> without_shadows(const List<View>& views, const std::vector<Other>& others);
constexpr double kOthersReach_px = 3;  ///< edges as near as this to another fragment's outline are its own
/// The edges but for those within `reach_px` of another's outline that have its direction, up to the tolerance.
List<EdgeMap> without_outlines(const List<View>& views, const List<EdgeMap>& edges, const std::vector<Other>& others,
                               double reach_px, double tolerance_deg);

}  // namespace marrow::match
