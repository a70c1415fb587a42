// SPDX-License-Identifier: Apache-2.0
#pragma once
// Derivatives of a mean over views of losses of residuals, with each block of the images left out.
#include <algorithm>
#include <numeric>
#include <vector>

#include "marrow/toolbox/match/views_cost.hpp"

namespace marrow::match {

/// What the blocks of one view add to the derivatives of a cost by a small motion and by an offset that all residuals
/// have in common.
class BlockExpansions {
 public:
  explicit BlockExpansions(const Blocks& blocks) : blocks_(blocks), of_block_(std::size_t(blocks.count())) {}

  /// A loss: its first and second derivative by the residual, and the residual's slope by the motion (r [rad], t [mm]).
  void add(double u_px, double v_px, const Vector6d& slope, double first, double second);
  /// A point whose loss counts in the view's mean.
  void count(double u_px, double v_px) {
    ++points_;
    ++of_block_[std::size_t(blocks_.at(u_px, v_px))].points;
  }

  /// The quadratic model of the cost without each block of each view in turn; its value is not set. The cost is the
  /// mean over the views, with these weights, of the sum of the losses divided by the number of points left, which
  /// counts as `least_points` at least. With `offset`, the residuals' common offset is the best at each motion.
  static std::vector<Cost::Expansion> without_each(const std::vector<BlockExpansions>& views,
                                                   const std::vector<double>& weights, double least_points,
                                                   bool offset);

 private:
  using Gradient = Eigen::Matrix<double, 7, 1>;  // the offset comes last
  using Curvature = Eigen::Matrix<double, 7, 7>;
  struct Part {
    Gradient gradient = Gradient::Zero();
    Curvature curvature = Curvature::Zero();  // only the lower half
    int points = 0;
  };
  Part sum() const;

  Blocks blocks_;
  std::vector<Part> of_block_;
  int points_ = 0;
};

inline void BlockExpansions::add(double u_px, double v_px, const Vector6d& slope, double first, double second) {
  Gradient by_all;
  by_all << slope, -1;
  Part& block = of_block_[std::size_t(blocks_.at(u_px, v_px))];
  block.gradient += first * by_all;
  block.curvature.selfadjointView<Eigen::Lower>().rankUpdate(by_all, second);
}
inline BlockExpansions::Part BlockExpansions::sum() const {
  Part all;
  for (const Part& block : of_block_) {
    all.gradient += block.gradient;
    all.curvature += block.curvature;
  }
  return all;
}
inline std::vector<Cost::Expansion> BlockExpansions::without_each(const std::vector<BlockExpansions>& views,
                                                                  const std::vector<double>& weights,
                                                                  double least_points, bool offset) {
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
