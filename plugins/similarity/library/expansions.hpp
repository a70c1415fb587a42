// SPDX-License-Identifier: Apache-2.0
#pragma once
// Quadratic models of measures that follow from sums over an image, by a small motion m = (r [rad], t [mm]).
#include <array>
#include <vector>

#include "marrow/toolbox/match/views_cost.hpp"

namespace marrow::match {

/// A place's share of a BlockSums::Sums, with derivatives. `curvature` is a part of minus the second derivative of the
/// values, without negative eigenvalues (Gauss-Newton).
struct SumsExpansion {
  BlockSums::Sums sums;
  Vector6d by_values = Vector6d::Zero(), by_weights = Vector6d::Zero();
  Matrix6d curvature = Matrix6d::Zero();

  SumsExpansion& operator+=(const SumsExpansion& more);
  SumsExpansion& operator-=(const SumsExpansion& less);
};

/// Sums of the products of pairs among: the six slopes of a radiograph, the radiograph and the image.
struct JointMoments {
  static constexpr int kRendered = 6, kSeen = 7;
  using Vector = Eigen::Matrix<double, 8, 1>;
  using Matrix = Eigen::Matrix<double, 8, 8>;

  double n = 0;
  bool shows_bone = false;  ///< if not, only the sums of the image are not 0, which saves time
  Vector sums = Vector::Zero();
  Matrix products = Matrix::Zero();

  void add(const Vector& values) {
    n += 1;
    shows_bone = true;
    sums += values;
    products.noalias() += values * values.transpose();
  }
  void add_pixel(const Vector6d& slopes, double rendered, double seen) {
    if (rendered == 0 && slopes.isZero(0)) {
      n += 1;
      sums[kSeen] += seen;
      products(kSeen, kSeen) += seen * seen;
      return;
    }
    Vector values;
    values << slopes, rendered, seen;
    add(values);
  }
  JointMoments& operator+=(const JointMoments& more);
  JointMoments& operator-=(const JointMoments& less);
  /// The products of the differences to the means. They need n > 0.
  Matrix spread() const { return products - sums * sums.transpose() / n; }
};

/// Pearson's correlation of radiograph and image, and minus its second derivative where the image is like the
/// radiograph but for noise. `spread` is the sum of the squares of the radiograph's differences to its mean.
struct CorrelationExpansion {
  double value = 0, spread = 0;
  Vector6d by_value = Vector6d::Zero(), by_spread = Vector6d::Zero();
  Matrix6d curvature = Matrix6d::Zero();
};
/// All 0 if fewer than 16 pixels count or the radiograph is constant. If the image is constant, the value is 0.
CorrelationExpansion correlation_expansion(const JointMoments& moments);

/// Adds up what the places of one view contribute, for the whole image and for each of its blocks.
class ExpansionTally {
 public:
  explicit ExpansionTally(const Blocks& blocks) : blocks_(blocks), of_block_(std::size_t(blocks.count())) {}
  void add(double u_px, double v_px, const SumsExpansion& one) {
    all_ += one;
    of_block_[std::size_t(blocks_.at(u_px, v_px))] += one;
  }
  const SumsExpansion& all() const { return all_; }
  const std::vector<SumsExpansion>& of_block() const { return of_block_; }

 private:
  Blocks blocks_;
  SumsExpansion all_;
  std::vector<SumsExpansion> of_block_;
};

/// Sums over pairs of values (a, b), from which their variances and covariance follow. Sums over parts may be added.
struct Moments {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double x, double y) { *this += {1, x, y, x * x, y * y, x * y}; }
  Moments& operator+=(const Moments& more) {
    n += more.n, a += more.a, b += more.b, aa += more.aa, bb += more.bb, ab += more.ab;
    return *this;
  }
  /// Sums of the products of the differences to the means. They need n > 0.
  double spread_a() const { return aa - a * a / n; }
  double spread_b() const { return bb - b * b / n; }
  double spread_ab() const { return ab - a * b / n; }
};

}  // namespace marrow::match
