// SPDX-License-Identifier: Apache-2.0
#include "normal.hpp"

#include <cmath>

#include "marrow/base/error.hpp"

#include "marrow/base/number_text.hpp"

namespace marrow::compare {

void check_confidence(double confidence) {
  if (!(confidence > 0 && confidence < 1))
    throw Error(formatted("the confidence is {:f}; give a fraction between 0 and 1, such as 0.95", confidence));
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
