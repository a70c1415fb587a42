// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace {

using marrow::search::SearchOptions;

struct Result {
  marrow::Pose pose;
  marrow::List<marrow::Pose> stages;
};

Result multiresolution(const marrow::Cost& cost, const marrow::Optimizer& optimizer, const marrow::Pose& start,
                       const marrow::Mesh* model, const SearchOptions& options, marrow::Context& context) {
  marrow::search::check_options(options);
  marrow::check_pose(start, "the pose to start from");
  const marrow::Pose initial = marrow::geometry::with_fragment_axes(start, model, context);
  const marrow::search::Levels levels = marrow::search::levels_of(cost, options);
  const marrow::Cost& last = *levels.back();
  marrow::search::Search search(optimizer, initial, options, context);
  Result result;
  result.stages.add("start", pose_of(search, initial, last));
  const marrow::search::Found best = search.find(levels);
  search.go_to(best.axial);
  result.stages.add("axial", pose_of(search, initial, last));
  search.go_to(best.pose);
  std::shared_ptr<const marrow::Cost> coarser;
  if (!options.pixel_step.empty())
    coarser = cost.at_level({options.contour_spacing_px.back(), options.reach_px.back(),
                             marrow::search::coarser_pixel_step(options.pixel_step.back())});
  result.pose =
      final_pose_of(search, initial, last, search.steps_of(levels.size() - 1), options, context, coarser.get());
  result.stages.add("final", result.pose);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("register.multiresolution", multiresolution);
  node.summary(
          "Registration from coarse to fine with shrinking steps: first rotation about and translation along the long "
          "axis, then all six parameters")
      .in("cost", "cost of a pose")
      .in("optimizer", "minimiser")
      .in("start", "pose to start from, and the fragment's axes")
      .in("model", "surface of the fragment: it gives the axes of a start that has none")
      .out("pose", &Result::pose, "pose of least cost, with its predicted covariance")
      .out("stages", &Result::stages, "poses of the search: start, axial, final", marrow::over("stage"));
  marrow::search::declare<SearchOptions>(node);
}
