// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

namespace marrow::match {

/// Loss of a distance d: sqrt(s^2 + d^2) - s with s = `scale`. Quadratic near zero, then nearly the distance itself, as
/// in the chapter. Constant from `reach` on. All functions take d^2.
class EdgeLoss {
 public:
  EdgeLoss(double scale, double reach)
      : scale2_(scale * scale), scale_(scale), reach2_(reach * reach), worst_(raw(reach2_)) {}
  double worst() const { return worst_; }
  double operator()(double distance2) const { return distance2 < reach2_ ? raw(distance2) : worst_; }
  /// Derivative by the distance, divided by the distance.
  double weight(double distance2) const { return distance2 < reach2_ ? 1 / std::sqrt(scale2_ + distance2) : 0; }
  /// Second derivative by one coordinate of the distance, whose square is `part2`. At most weight().
  double curvature(double distance2, double part2) const {
    const double sum = scale2_ + distance2;
    return distance2 < reach2_ ? (sum - part2) / (sum * std::sqrt(sum)) : 0;
  }

 private:
  double raw(double distance2) const { return std::sqrt(scale2_ + distance2) - scale_; }
  double scale2_, scale_, reach2_, worst_;
};

}  // namespace marrow::match
