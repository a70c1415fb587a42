// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which of so many bins of equal width a value falls into.
#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/toolbox/match/intensity.hpp"

namespace marrow::match {

struct Bins {
  double low = 0, per_unit = 0;
  int count = 1;

  int of(double value) const { return std::clamp(int((value - low) * per_unit), 0, count - 1); }
};

/// From the least to the greatest value that counts; all values in the first bin where they are the same.
inline Bins bins_of(const std::vector<float>& values, const std::vector<char>& counts, int bins) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (counts[i]) low = std::min(low, double(values[i])), high = std::max(high, double(values[i]));
  return {low, high > low ? bins / (high - low) : 0, bins};
}

/// -sum p log p, in natural units.
inline double entropy(const std::vector<double>& counts, double total) {
  double sum = 0;
  for (const double count : counts)
    if (count > 0) sum -= count / total * std::log(count / total);
  return sum;
}

}  // namespace marrow::match
