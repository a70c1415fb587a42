// SPDX-License-Identifier: Apache-2.0
// Target registration error: the distance between the positions of a target under the found and under the true pose.
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/targets.hpp"

namespace {

using namespace marrow;

struct Options {
  int points = 500;
};

Metrics mtre(const Pose& pose, const Truth& truth, const Mesh* model, const Landmarks* landmarks,
             const Options& options) {
  geometry::check_poses(pose.world_from_model, truth.world_from_model);
  const std::vector<double> errors =
      geometry::target_errors_mm(pose.world_from_model, truth.world_from_model,
                                 geometry::targets_mm(pose.world_from_model, model, landmarks, options.points));
  Metrics metrics;
  metrics.items = {{"mtre_mm", geometry::mean(errors), "mm"},
                   {"rms_mm", geometry::root_mean_square(errors), "mm"},
                   {"max_mm", *std::max_element(errors.begin(), errors.end()), "mm"}};
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.mtre", mtre)
      .summary(
          "Target registration error over the fragment's surface or its landmarks: mean, root mean square, maximum")
      .in("pose", "pose found")
      .in("truth", "exact pose")
      .in("model", "surface of the fragment; the targets are spread over it")
      .in("landmarks", "landmarks to use as targets instead")
      .relation(at_least_one({"in.model", "in.landmarks"}))
      .out("metrics", "mTRE (mean; van de Kraats et al., IEEE TMI 2005), root mean square and largest error")
      .figures({"mtre_mm", "rms_mm", "max_mm"})
      .option("points", &Options::points, "number of targets spread over the surface", at_least(1), at_most(1e6));
}
