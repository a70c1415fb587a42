// SPDX-License-Identifier: Apache-2.0
// Searches from elsewhere. Those from near must come back to the pose; those from far must not end in a cost as low.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "judged.hpp"
#include "marrow/domain/quantile.hpp"

namespace marrow::verdict {
namespace {

constexpr double kSame_mm = 1.5, kSame_deg = 4;  ///< a minimum within both is that of the pose
constexpr double kMost = 3;

Vector6d motion(double frontal, double lateral, double axial, double x, double y, double z) {
  Vector6d one;
  one << frontal, lateral, axial, x, y, z;
  return one;
}

/// Motions to the far starts, in degrees and mm.
std::vector<Vector6d> far_motions() {
  return {motion(0, 0, 15, 0, 0, 0),  motion(0, 0, -15, 0, 0, 0), motion(0, 0, 35, 0, 0, 0),
          motion(0, 0, -35, 0, 0, 0), motion(0, 0, 180, 0, 0, 0), motion(0, 0, 0, 0, 0, 12),
          motion(0, 0, 0, 0, 0, -12), motion(6, 0, 0, 0, 6, 0),   motion(0, -6, 0, -6, 0, 0)};
}

/// The cost's value at the pose, and how far the cost typically rises above it at the starts.
struct Scale {
  double own, rise;
  Scale(const Judged& judged, const Cost& cost, const std::vector<RigidTransform>& starts)
      : own(cost.value(judged.pose.world_from_model)), rise(quantile(cost.values(starts), 0.5) - own) {}
  /// 0: no better than the starts; 1: as good as the pose; above 1: better.
  double closeness(double value) const { return rise > 0 ? std::clamp(1 - (value - own) / rise, 0.0, kMost) : kMost; }
};

}  // namespace

Evidence other_minima(const Judged& judged, const Cost& coarse, const Cost& cost) {
  constexpr double kWorthRefining = 0.5;
  std::vector<RigidTransform> starts = near_starts(judged);
  const std::size_t near_count = starts.size();
  for (const Vector6d& one : far_motions()) starts.push_back(judged.moved_by(judged.pose.world_from_model, one));
  const Scale coarse_scale(judged, coarse, starts), scale(judged, cost, starts);
  starts.push_back(judged.pose.world_from_model);
  std::vector<Minimum> found(starts.size());
  tbb::parallel_for(std::size_t(0), starts.size(), [&](std::size_t i) {
    found[i] = minimum_near(judged, coarse, starts[i], {2, 4, 2, 0.05}, 70);
    found[i].value = coarse_scale.closeness(found[i].value);
    const bool is_near = i < near_count || i + 1 == starts.size();
    if (!is_near && found[i].value < kWorthRefining) return;
    // Those from near go on to the end, because the place of an early stop would depend on the last digits of the pose.
    if (is_near)
      found[i] = minimum_near(judged, cost, found[i].pose, {0.5, 1, 0.5, 0.01}, 150);
    else
      found[i] = minimum_near(judged, cost, found[i].pose, {0.5, 1, 0.5, 0.05}, 40);
    found[i].value = scale.closeness(found[i].value);
  });
  double best_other = 0, best = 1;
  std::vector<double> near_mm, near_deg;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double off_mm = judged.off_mm(found[i].pose), axial_deg = judged.axial_deg(found[i].pose);
    if (i < near_count) near_mm.push_back(off_mm), near_deg.push_back(axial_deg);
    best = std::max(best, found[i].value);
    if (off_mm > kSame_mm || axial_deg > kSame_deg) best_other = std::max(best_other, found[i].value);
  }
  return {{"other_minimum", best_other, ""},
          {"better_minimum", best - 1, ""},
          {"apart_mm", judged.off_mm(found.back().pose), "mm"},
          {"apart_deg", judged.axial_deg(found.back().pose), "deg"},
          {"restarts_mm", *std::max_element(near_mm.begin(), near_mm.end()), "mm"},
          {"restarts_deg", *std::max_element(near_deg.begin(), near_deg.end()), "deg"}};
}

}  // namespace marrow::verdict
