// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which blocks of the images say something about a pose. If only one or two do, nothing tells how far the minimum would
// move without them, so the jackknife predicts no deviations.
#include <algorithm>
#include <cmath>
#include <map>
#include <marrow/domain/functions.hpp>
#include <set>
#include <vector>

namespace marrow::search {

constexpr std::size_t kFewBlocks = 2;

/// The blocks that change the cost when they are left out.
inline std::set<Eigen::Index> blocks_that_speak(const Eigen::VectorXd& without_block, double whole) {
  constexpr double kRounding = 1e-9;  // relative, of sums from which those of a block are taken away
  std::set<Eigen::Index> speak;
  for (Eigen::Index i = 0; i < without_block.size(); ++i)
    if (!(std::abs(without_block[i] - whole) <= kRounding * std::max(std::abs(without_block[i]), std::abs(whole))))
      speak.insert(i);
  return speak;
}

/// Their number, by derivatives: without any of the other blocks the expansion is the same.
inline std::size_t count_of_blocks_that_speak(const std::vector<Cost::Expansion>& without_block) {
  std::map<double, int> alike;
  for (const Cost::Expansion& one : without_block) ++alike[one.curvature.sum() + one.gradient.sum()];
  return std::size_t(std::count_if(alike.begin(), alike.end(), [](const auto& one) { return one.second == 1; }));
}

}  // namespace marrow::search
