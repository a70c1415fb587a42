// SPDX-License-Identifier: Apache-2.0
#include "marrow/plan/length_quantile.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::plan {
namespace {

/// The probability that a vector with these variances along two axes is longer. Scaled by its deviations, the vector
/// has a uniform direction and a Rayleigh length. So the probability is the mean over the directions of exp(-length^2 /
/// (2 variance along the direction)). The function is smooth and periodic, so few points give all digits.
double longer_than(double length, double large, double small) {
  constexpr int kDirections = 128;  // of a quarter turn; the others are alike
  double sum = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 0.5 * kPi * (i + 0.5) / kDirections, cosine = std::cos(angle);
    const double variance = small + (large - small) * cosine * cosine;
    sum += std::exp(-0.5 * length * length / variance);
  }
  return sum / kDirections;
}

}  // namespace

double length_quantile(const Eigen::Matrix3d& covariance, double probability) {
  if (!covariance.allFinite()) return std::sqrt(covariance.trace());
  const Eigen::Vector3d variances = eigen_of_symmetric<3>(covariance).values;
  const double large = variances[2], small = std::max(0.0, variances[1]);
  if (!(large > 0)) return 0;
  double low = 0, high = std::sqrt(-2 * large * std::log(1 - probability));  // as if it were a circle
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (longer_than(middle, large, small) > 1 - probability ? low : high) = middle;
  }
  return high;
}

}  // namespace marrow::plan
