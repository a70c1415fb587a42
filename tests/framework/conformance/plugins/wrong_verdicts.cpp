// SPDX-License-Identifier: Apache-2.0
// Verdicts for the tests of `marrow conformance`: a plain right one, and others that say the same of every pose.
#include <marrow/plugin.hpp>

namespace {

using namespace marrow;

Verdict said(Judgement judgement, const char* reason) {
  Verdict verdict;
  verdict.judgement = judgement;
  verdict.reasons = {reason};
  if (judgement != Judgement::trusted) verdict.remedies = {"a look at the overlay of each view"};
  return verdict;
}

/// The share of the outline without an edge within 2 px, in the worst view.
double unexplained(const Pose& pose, const List<View>& views, const List<EdgeMap>& edges,
                   const OutlineProjector& projector) {
  double worst = views.empty() ? 1 : 0;
  for (const View& view : views) {
    const EdgeMap* map = edges.find(view.name);
    const std::vector<OutlinePoint> outline = projector.outline(view.camera, pose.world_from_model, 3);
    const auto has_edge = [&](const OutlinePoint& point) {
      return map && std::any_of(map->pixels.begin(), map->pixels.end(), [&](const EdgePixel& edge) {
               return std::hypot(edge.u_px - point.u_px, edge.v_px - point.v_px) < 2;
             });
    };
    const auto found = double(std::count_if(outline.begin(), outline.end(), has_edge));
    worst = std::max(worst, outline.empty() ? 1 : 1 - found / double(outline.size()));
  }
  return worst;
}

Verdict plain(const Pose& pose, const List<View>& views, const List<EdgeMap>& edges,
              const OutlineProjector& projector) {
  check_pose(pose, "pose");
  const bool is_known = pose.covariance && pose.covariance->allFinite() && !pose.covariance->isZero(0) &&
                        std::sqrt(pose.covariance->bottomRightCorner<3, 3>().trace()) < 2 &&
                        std::sqrt(pose.covariance->topLeftCorner<3, 3>().trace()) < radians(5);
  if (!is_known) return said(Judgement::doubtful, "the predicted deviations are large, or there are none");
  if (unexplained(pose, views, edges, projector) < 0.1) return said(Judgement::trusted, "the outline has its edges");
  return said(Judgement::wrong, "a part of the outline has no edge");
}

template <Judgement judgement>
Verdict always(const Pose& pose, const List<View>&, const List<EdgeMap>&, const OutlineProjector&) {
  check_pose(pose, "pose");
  return said(judgement, "it is the same for every pose");
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("for a test")
        .in("pose", "pose to judge")
        .in("views", "X-ray views", over("view"))
        .in("edges", "edge pixels of each view", over("view"))
        .in("projector", "draws the bone's outline")
        .out("verdict", "judgement of the pose");
  };
  add("verdict.plain", plain);
  add("verdict.trusting", always<Judgement::trusted>);
  add("verdict.doubting", always<Judgement::doubtful>);
  add("verdict.denying", always<Judgement::wrong>);
}
