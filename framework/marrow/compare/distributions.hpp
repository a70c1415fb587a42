// SPDX-License-Identifier: Apache-2.0
#pragma once
// The beta, Student's and the normal distribution by Boost.Math, under the names that the statistics use, and the
// interval that follows from the normal one.
#include <limits>

#include "marrow/compare/statistics.hpp"

namespace marrow::compare {

/// A difference that a failure makes, or a bound that too few cases leave open.
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// I_x(a, b), the regularized incomplete beta function (Olver et al. 2010, NIST Handbook of Mathematical Functions,
/// section 8.17). a and b are positive. For whole k < n, it is the probability of at most k heads in n throws of a fair
/// coin with a = n - k, b = k + 1 and x = 0.5.
double incomplete_beta(double a, double b, double x);

/// The x with I_x(a, b) = p. p is between 0 and 1.
double beta_quantile(double p, double a, double b);

/// The t for which Student's t with `freedom` degrees of freedom is farther from 0 with the probability `outside`.
double student_quantile(double outside, double freedom);

/// Probability that a standard normal variable is larger than z.
double upper_tail(double z);

/// The z with upper_tail(z) = tail; 40 for a tail too small for a double.
double z_of_tail(double tail);

/// Wilson's interval of a rate that was seen in `runs` independent runs, which need not be a whole number.
Interval score_interval(double rate, double runs, double confidence);

}  // namespace marrow::compare
