// SPDX-License-Identifier: Apache-2.0
#pragma once
// The normal distribution, and the score interval that follows from it.
#include "marrow/compare/statistics.hpp"

namespace marrow::compare {

/// Probability that a standard normal variable is larger than z.
double upper_tail(double z);

/// The z >= 0 with upper_tail(z) = tail, by bisection down to neighbouring doubles. 40 for a tail too small for that.
double z_of_tail(double tail);

/// Wilson's interval of a rate that was seen in `runs` independent runs, which need not be a whole number.
Interval score_interval(double rate, double runs, double confidence);

/// Throws Error for a confidence that is not between 0 and 1.
void check_confidence(double confidence);

}  // namespace marrow::compare
