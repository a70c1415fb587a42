// SPDX-License-Identifier: Apache-2.0
#include "distributions.hpp"

#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace marrow::compare {
namespace {

constexpr double kFarthest = 40;  // its tail is below the smallest double

/// Not by long double: the levels of looks take millions of its tails.
using Normal =
    boost::math::normal_distribution<double,
                                     boost::math::policies::policy<boost::math::policies::promote_double<false>>>;

}  // namespace

double incomplete_beta(double a, double b, double x) {
  if (x <= 0 || x >= 1) return x <= 0 ? 0 : 1;
  return boost::math::cdf(boost::math::beta_distribution<>(a, b), x);
}

double beta_quantile(double p, double a, double b) {
  return boost::math::quantile(boost::math::beta_distribution<>(a, b), p);
}

double student_quantile(double outside, double freedom) {
  return boost::math::quantile(boost::math::complement(boost::math::students_t_distribution<>(freedom), outside / 2));
}

double upper_tail(double z) { return boost::math::cdf(boost::math::complement(Normal(), z)); }

double z_of_tail(double tail) {
  if (tail <= upper_tail(kFarthest)) return kFarthest;
  return boost::math::quantile(boost::math::complement(Normal(), tail));
}

Interval score_interval(double rate, double runs, double confidence) {
  const double z = z_of_tail((1 - confidence) / 2);
  const double centre = (rate + z * z / (2 * runs)) / (1 + z * z / runs);
  const double half = z / (1 + z * z / runs) * std::sqrt(rate * (1 - rate) / runs + z * z / (4 * runs * runs));
  // With no successes the lower bound is exactly 0, and with all successes the upper bound is exactly 1. Rounding would
  // miss this.
  return {rate == 0 ? 0.0 : centre - half, rate == 1 ? 1.0 : centre + half, confidence};
}

}  // namespace marrow::compare
