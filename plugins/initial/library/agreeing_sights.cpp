// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/agreeing_sights.hpp"

#include <algorithm>
#include <cmath>
#include <marrow/base/error.hpp>
#include <set>

#include "marrow/initial/reprojection_fit.hpp"

namespace marrow::initial {
namespace {

constexpr std::size_t kLeastSights = 6;
constexpr double kMostVariance = 4;  // of least squares with all sights, in units of that which is stated
constexpr double kBound = kMostDeviations * kMostDeviations;  // c^2 of the paper

/// The sights with more deviation, so that their squares count by these weights. Those without weight are left out.
std::vector<Sight> weighted(const std::vector<Sight>& sights, const std::vector<double>& weights) {
  std::vector<Sight> result;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (weights[i] <= 0) continue;
    result.push_back(sights[i]);
    result.back().deviation_px /= std::sqrt(weights[i]);
  }
  return result;
}

/// The pose of least truncated squares near a pose. The control parameter grows from nearly convex to truncated.
RigidTransform without_wrong(const std::vector<Sight>& sights, RigidTransform pose, const FragmentFrame& frame) {
  constexpr double kGrowth = 1.4;  // as in the paper
  constexpr int kMostSteps = 100;
  double largest = 0;
  for (const Sight& sight : sights) largest = std::max(largest, square_of(sight, pose));
  if (!std::isfinite(largest) || largest <= kBound) return pose;
  std::vector<double> weights(sights.size());
  double control = kBound / (2 * largest - kBound);
  for (int step = 0; step < kMostSteps; ++step, control *= kGrowth) {
    bool is_decided = true;
    for (std::size_t i = 0; i < sights.size(); ++i) {
      const double square = square_of(sights[i], pose);
      if (square >= (control + 1) / control * kBound)
        weights[i] = 0;
      else if (square <= control / (control + 1) * kBound)
        weights[i] = 1;
      else
        weights[i] = std::sqrt(kBound / square * control * (control + 1)) - control, is_decided = false;
    }
    const std::vector<Sight> kept = weighted(sights, weights);
    if (kept.size() < 4) return pose;
    pose = refined(kept, pose, frame);
    if (is_decided) break;
  }
  return pose;
}

double truncated_squares(const std::vector<Sight>& sights, const RigidTransform& pose) {
  double sum = 0;
  for (const Sight& sight : sights) sum += std::min(kBound, square_of(sight, pose));
  return sum;
}

/// Minima from all sights, and from those without each name, of which one is without the wrong one.
std::vector<Candidate> starts_of(const std::vector<Sight>& sights, const FragmentFrame& frame) {
  std::vector<Candidate> starts;
  const auto add = [&](const std::vector<Sight>& some) {
    try {
      for (const Candidate& one : minima(some, frame)) starts.push_back(one);
    } catch (const Error&) {  // the mirror image, because of the wrong one
    }
  };
  add(sights);
  std::set<std::string> names;
  for (const Sight& sight : sights) names.insert(sight.name);
  for (const std::string& name : names) {
    std::vector<Sight> others;
    std::copy_if(sights.begin(), sights.end(), std::back_inserter(others),
                 [&](const Sight& sight) { return sight.name != name; });
    add(others);
  }
  return starts;
}

}  // namespace

std::vector<bool> agreeing_sights(const std::vector<Sight>& sights, const FragmentFrame& frame) {
  const std::vector<bool> all(sights.size(), true);
  if (sights.size() < kLeastSights) return all;
  const auto agrees = [](const Sight& sight, const RigidTransform& pose) { return square_of(sight, pose) <= kBound; };
  try {
    const std::vector<Candidate> found = minima(sights, frame);
    const double freedom = 2 * double(sights.size()) - 6;
    if (!found.empty() && found.front().squares <= kMostVariance * freedom &&
        std::all_of(sights.begin(), sights.end(),
                    [&](const Sight& sight) { return agrees(sight, found.front().pose); }))
      return all;
  } catch (const Error&) {  // the mirror image: perhaps because of a wrong one
  }
  RigidTransform best;
  double least = kBound * double(sights.size());
  for (const Candidate& start : starts_of(sights, frame)) {
    const RigidTransform pose = without_wrong(sights, start.pose, frame);
    if (const double value = truncated_squares(sights, pose); value < least) best = pose, least = value;
  }
  std::vector<bool> good;
  for (const Sight& sight : sights) good.push_back(least < kBound * double(sights.size()) && agrees(sight, best));
  const auto wrong = std::size_t(std::count(good.begin(), good.end(), false));
  return 3 * wrong > sights.size() ? all : good;
}

}  // namespace marrow::initial
