// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bins of equal width for histograms.
#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/similarity/intensity.hpp"

namespace marrow::match {

struct Bins {
  double low = 0, per_unit = 0;
  int count = 1;

  /// The bin of a value. Values out of range go to the first or last bin.
  int of(double value) const { return std::clamp(int((value - low) * per_unit), 0, count - 1); }
};

/// Bins from the smallest to the largest value that counts. If all are equal, they fall into the first bin.
inline Bins bins_of(const std::vector<float>& values, const std::vector<char>& counts, int bins) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (counts[i]) low = std::min(low, double(values[i])), high = std::max(high, double(values[i]));
  return {low, high > low ? bins / (high - low) : 0, bins};
}

/// Entropy -sum p log p with p = count / total and the natural logarithm.
inline double entropy(const std::vector<double>& counts, double total) {
  double sum = 0;
  for (const double count : counts)
    if (count > 0) sum -= count / total * std::log(count / total);
  return sum;
}

}  // namespace marrow::match
