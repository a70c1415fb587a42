// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/block_expansions.hpp"

#include <algorithm>
#include <numeric>

namespace marrow::match {

void BlockExpansions::add(double u_px, double v_px, const Vector6d& slope, double first, double second) {
  Gradient by_all;
  by_all << slope, -1;
  Part& block = of_block_[std::size_t(blocks_.at(u_px, v_px))];
  block.gradient += first * by_all;
  block.curvature.selfadjointView<Eigen::Lower>().rankUpdate(by_all, second);
}

BlockExpansions::Part BlockExpansions::sum() const {
  Part all;
  for (const Part& block : of_block_) {
    all.gradient += block.gradient;
    all.curvature += block.curvature;
  }
  return all;
}

std::vector<Cost::Expansion> BlockExpansions::without_each(const std::vector<BlockExpansions>& views,
                                                           const std::vector<double>& weights, double least_points,
                                                           bool offset) {
  const double of_all = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<Part> sums;
  for (const BlockExpansions& view : views) sums.push_back(view.sum());
  std::vector<Cost::Expansion> expansions;
  for (std::size_t left = 0; left < views.size(); ++left)
    for (const Part& block : views[left].of_block_) {
      Gradient gradient = Gradient::Zero();
      Curvature curvature = Curvature::Zero();
      for (std::size_t i = 0; i < views.size(); ++i) {
        const double points = std::max(double(views[i].points_ - (i == left ? block.points : 0)), least_points),
                     share = weights[i] / of_all / points;
        gradient += share * sums[i].gradient;
        curvature += share * sums[i].curvature;
        if (i != left) continue;
        gradient -= share * block.gradient;
        curvature -= share * block.curvature;
      }
      Cost::Expansion& about = expansions.emplace_back();
      const Curvature whole = curvature.selfadjointView<Eigen::Lower>();
      about.gradient = gradient.head<6>();
      about.curvature = whole.topLeftCorner<6, 6>();
      if (!offset || !(whole(6, 6) > 0)) continue;
      const Vector6d mixed = whole.topRightCorner<6, 1>();
      about.gradient -= mixed * gradient[6] / whole(6, 6);
      about.curvature -= mixed * mixed.transpose() / whole(6, 6);
    }
  return expansions;
}

}  // namespace marrow::match
