// SPDX-License-Identifier: Apache-2.0
// How the cost changes around a pose. At the right pose it lies far below the cost of all other poses; near a wrong one
// it is hardly lower than elsewhere.
#include <algorithm>
#include <cmath>

#include "judged.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::verdict {
namespace {

constexpr double kTurnStep_deg = 10;
constexpr double kNearTurn_deg = 15;  ///< nearer poses belong to the same minimum
constexpr int kDecoys = 48;
constexpr double kNearestDecoy_mm = 4, kFarthestDecoy_mm = 24;

/// Poses in random directions, at distances (mTRE) spread evenly in their logarithm.
std::vector<RigidTransform> decoys(const Judged& judged) {
  Random random(1);
  std::vector<RigidTransform> poses;
  for (int i = 0; i < kDecoys; ++i) {
    Vector6d motion;
    for (double& one : motion) one = random.normal();
    motion.tail<3>() *= 2;
    motion[2] *= 2;  // the bone is slender: a rotation about its long axis moves its surface least
    const double wanted_mm =
        kNearestDecoy_mm * std::pow(kFarthestDecoy_mm / kNearestDecoy_mm, (i + 0.5) / double(kDecoys));
    const double off_mm = judged.off_mm(judged.moved_by(judged.pose.world_from_model, motion));
    poses.push_back(judged.moved_by(judged.pose.world_from_model, motion * (wanted_mm / off_mm)));
  }
  return poses;
}

/// 0 if the best of the others is as bad as their median; 1 if it is as good as the pose; more if it is better.
double closeness(double best_other, double own, double median) {
  constexpr double kMost = 3;
  if (!(median > own)) return kMost;
  return std::clamp(1 - (best_other - own) / (median - own), 0.0, kMost);
}

}  // namespace

Evidence landscape(const Judged& judged, const Cost& cost, const std::string& prefix) {
  std::vector<RigidTransform> poses{judged.pose.world_from_model};
  const std::vector<RigidTransform> others = decoys(judged);
  poses.insert(poses.end(), others.begin(), others.end());
  for (double turn_deg = kNearTurn_deg; turn_deg <= 360 - kNearTurn_deg; turn_deg += kTurnStep_deg) {
    Vector6d motion = Vector6d::Zero();
    motion[2] = turn_deg;
    poses.push_back(judged.moved_by(judged.pose.world_from_model, motion));
  }
  const std::vector<double> values = cost.values(poses);
  const double own = values[0];
  const std::vector<double> of_decoys(values.begin() + 1, values.begin() + 1 + kDecoys);
  const std::vector<double> of_turn(values.begin() + 1 + kDecoys, values.end());
  const double median = quantile(of_decoys, 0.5);
  const double scatter = quantile(of_decoys, 0.84) - quantile(of_decoys, 0.16);
  const auto least = [](const std::vector<double>& of) { return *std::min_element(of.begin(), of.end()); };
  constexpr double kMostScatter = 10;
  return {
      {prefix + "decoys_scatter", median > own ? std::min(scatter / (median - own), kMostScatter) : kMostScatter, ""},
      {prefix + "best_decoy", closeness(least(of_decoys), own, median), ""},
      {prefix + "best_turned", closeness(least(of_turn), own, median), ""}};
}

}  // namespace marrow::verdict
