// SPDX-License-Identifier: Apache-2.0
#include "distributions.hpp"

#include <cmath>

namespace marrow::compare {
namespace {

/// 1 + d1 / (1 + d2 / (1 + ...)) of the handbook's Eq 8.17.22, by the modified method of Lentz (Thompson and Barnett
/// 1986, J Comput Phys 64:490). It converges fast for x below (a + 1) / (a + b + 2).
double beta_fraction(double a, double b, double x) {
  const auto not_zero = [](double value) { return std::abs(value) < 1e-300 ? 1e-300 : value; };
  double value = 1, above = 1, below = 0;
  for (int step = 1; step < 100000; ++step) {
    const double m = step / 2;  // whole
    const double d = step % 2 ? -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
                              : m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    below = 1 / not_zero(1 + d * below);
    above = not_zero(1 + d / above);
    value *= above * below;
    if (std::abs(above * below - 1) < 1e-15) break;
  }
  return value;
}

}  // namespace

double incomplete_beta(double a, double b, double x) {
  if (x <= 0 || x >= 1) return x <= 0 ? 0 : 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - incomplete_beta(b, a, 1 - x);
  const double log_factor = a * std::log(x) + b * std::log1p(-x) + std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b);
  return std::exp(log_factor) / (a * beta_fraction(a, b, x));
}

double beta_quantile(double p, double a, double b) {
  double below = 0, above = 1;
  while (above - below > 1e-15) {
    const double middle = 0.5 * (below + above);
    if (middle <= below || middle >= above) break;
    (incomplete_beta(a, b, middle) < p ? below : above) = middle;
  }
  return 0.5 * (below + above);
}

double student_quantile(double outside, double freedom) {
  const double x = beta_quantile(outside, 0.5 * freedom, 0.5);  // of freedom / (freedom + t^2)
  return std::sqrt(freedom * (1 - x) / x);
}

double upper_tail(double z) { return 0.5 * std::erfc(z / std::sqrt(2.0)); }

double z_of_tail(double tail) {
  double below = 0, above = 40;
  for (;;) {
    const double middle = 0.5 * (below + above);
    if (middle <= below || middle >= above) return middle;
    (upper_tail(middle) > tail ? below : above) = middle;
  }
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
