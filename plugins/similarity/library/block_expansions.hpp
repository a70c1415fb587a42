// SPDX-License-Identifier: Apache-2.0
#pragma once
// Derivatives of a mean over views of losses of residuals, with each block of the images left out.
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

}  // namespace marrow::match
