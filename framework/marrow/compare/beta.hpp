// SPDX-License-Identifier: Apache-2.0
#pragma once
// The beta distribution, from which the quantiles of Student's t and of binomial proportions follow.

namespace marrow::compare {

/// I_x(a, b), the regularized incomplete beta function (Olver et al. 2010, NIST Handbook of Mathematical Functions,
/// section 8.17). a and b are positive. For whole k < n, it is the probability of at most k heads in n throws of a fair
/// coin with a = n - k, b = k + 1 and x = 0.5.
double incomplete_beta(double a, double b, double x);

/// The x with I_x(a, b) = p, by bisection to within 1e-15. p is between 0 and 1.
double beta_quantile(double p, double a, double b);

/// The t for which Student's t with `freedom` degrees of freedom is farther from 0 with the probability `outside`.
double student_quantile(double outside, double freedom);

}  // namespace marrow::compare
