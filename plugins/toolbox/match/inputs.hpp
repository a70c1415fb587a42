// SPDX-License-Identifier: Apache-2.0
#pragma once
// Inputs of costs: views, their edges and weights, and other fragments that the same images show.
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "marrow/plugin.hpp"

namespace marrow::match {

/// Throws Error if there are no views, or if check_view() or check_camera() refuses one.
void check_views(const List<View>& views);
/// Throws Error unless there are no weights, or one for each view. Weights must be at least 0, and not all 0.
void check_weights(const std::vector<double>& weights, std::size_t views);
/// Throws Error unless there is at least one view, and for each view a valid camera and an edge map that is not empty
/// and has the camera's size.
void check_edges(const List<View>& views, const List<EdgeMap>& edges);

/// "view 'lateral': " and then the text; empty if the text is.
inline std::string in_view(const List<View>& views, std::size_t view, const std::string& text) {
  return text.empty() ? text : "view '" + views.name(view) + "': " + text;
}

/// The weight of a view. Without weights all views count equally.
inline double weight_of(const std::vector<double>& weights, std::size_t view) {
  return weights.empty() ? 1 : weights[view];
}

/// Another fragment in its known pose, with the projector that draws it. The projector must outlive this.
struct Other {
  std::variant<const OutlineProjector*, const RadiographProjector*> projector;
  RigidTransform world_from_model;
};
/// The same for outlines only.
struct OtherOutline {
  const OutlineProjector* projector;
  RigidTransform world_from_model;
};
template <class Projector>
using OtherDrawnBy = std::conditional_t<std::is_same_v<Projector, OutlineProjector>, OtherOutline, Other>;

/// All fragments of the lists except the one that `own` draws. That one is recognised because it is the same object.
/// Poses and projectors are matched by name. Lists may be null. Throws Error for poses without projectors or projectors
/// without poses, for a fragment without a pose, or if there are others but `own` is null. `own_port` names the node's
/// input for `own` in the message.
template <class Projector>
std::vector<OtherDrawnBy<Projector>> others_of(const Projector* own, const List<Pose>* poses,
                                               const List<Projector>* projectors,
                                               const std::string& own_port = "projector");
/// The same, and in addition the bodies that `outlines` draw. None of these may be the fragment itself.
std::vector<Other> shadows_of(const RadiographProjector* own, const List<Pose>* poses,
                              const List<RadiographProjector>* projectors, const List<OutlineProjector>* outlines);

/// The views with masks that also exclude the others: pixels where their radiographs are above 0, or inside their
/// outlines.
List<View> without_shadows(const List<View>& views, const std::vector<Other>& others);
constexpr double kOthersReach_px = 3;  ///< edges nearer than this to another fragment's outline belong to that fragment
/// The edges without those that lie within `reach_px` of another fragment's outline and have its direction, up to
/// `tolerance_deg`.
List<EdgeMap> without_outlines(const List<View>& views, const List<EdgeMap>& edges,
                               const std::vector<OtherOutline>& others, double reach_px, double tolerance_deg);

}  // namespace marrow::match
