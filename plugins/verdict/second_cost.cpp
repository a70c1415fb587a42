// SPDX-License-Identifier: Apache-2.0
// Where a second cost leads from a pose. The search begins at the pose that is judged, not where its own search began:
// so the same pose is judged alike, whatever led to it.
#include <tbb/parallel_for.h>

#include "judged.hpp"

namespace marrow::verdicts {
namespace {

constexpr double kSpacing_px = 2, kReach_px = 6;  ///< of the finest level
constexpr double kClearlyBetter = 0.95;           ///< of the cost of the minimum next to the pose

/// The minima next to the pose and around it, the pose's own first.
std::vector<Minimum> minima_around(const Judged& judged, const Cost& cost) {
  std::vector<RigidTransform> starts = near_starts(judged);
  starts.insert(starts.begin(), judged.pose.world_from_model);
  for (const double turn_deg : {-8.0, 8.0}) {
    Vector6d motion = Vector6d::Zero();
    motion[2] = turn_deg;
    starts.push_back(judged.moved_by(judged.pose.world_from_model, motion));
  }
  const auto coarse = cost.at_level({4 * kSpacing_px, 4 * kReach_px, 0}),
             fine = cost.at_level({2 * kSpacing_px, 2 * kReach_px, 0});
  std::vector<Minimum> found(starts.size());
  tbb::parallel_for(std::size_t(0), starts.size(), [&](std::size_t i) {
    found[i] = minimum_near(judged, *coarse, starts[i], {2, 4, 2, 0.05}, 70);
    found[i] = minimum_near(judged, *fine, found[i].pose, {0.5, 1, 0.5, 0.05}, 70);
  });
  return found;
}

}  // namespace

Apart second_cost(const Judged& judged, const Cost& cost) {
  const std::vector<Minimum> found = minima_around(judged, cost);
  const Minimum* best = &found[0];
  for (const Minimum& other : found)
    if (other.value < kClearlyBetter * found[0].value && other.value < best->value) best = &other;
  const auto finest = cost.at_level({kSpacing_px, kReach_px, 0});
  const RigidTransform there = minimum_near(judged, *finest, best->pose, {0.3, 1, 0.3, 0.01}, 200).pose;
  return {judged.off_mm(there), judged.axial_deg(there)};
}

}  // namespace marrow::verdicts
