// SPDX-License-Identifier: Apache-2.0
#include "quantile.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/domain/error.hpp"

#include "marrow/domain/number_text.hpp"

namespace marrow::compare {

void check_finite(const std::vector<double>& values, const std::string& what) {
  if (values.empty()) throw Error("there are no " + what + "s; give at least one");
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      throw Error(what + " " + std::to_string(i + 1) + " of " + std::to_string(values.size()) + " is " +
                  formatted("%f", values[i]) +
                  ", which is no number to compare; count its run as failed, and give the rest");
}

void check_resamples(std::size_t resamples) {
  if (resamples < 1000)
    throw Error("got " + std::to_string(resamples) +
                " resamples; the bounds need at least 1000 (10000 is the default)");
}

double quantile(const std::vector<double>& sorted, double fraction) {
  const double position = fraction * static_cast<double>(sorted.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(position), sorted.size() - 1);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (position - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

double median_of_sorted(const std::vector<double>& sorted) {
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
}

double median_in_place(std::vector<double>& values) {
  const auto half = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), half, values.end());
  return values.size() % 2 ? *half : 0.5 * (*std::max_element(values.begin(), half) + *half);
}

}  // namespace marrow::compare
