// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/statistics.hpp"

#include <algorithm>
#include <numeric>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/quantile.hpp"
#include "value_checks.hpp"

namespace marrow::compare {

Interval wilson_interval(std::size_t successes, std::size_t trials, double confidence) {
  check_confidence(confidence);
  if (trials == 0) throw Error("a success rate of no trials has no interval; give at least one trial");
  if (successes > trials)
    throw Error(
        formatted("got {} successes of {} trials; expected at most as many successes as trials", successes, trials));
  return score_interval(static_cast<double>(successes) / static_cast<double>(trials), static_cast<double>(trials),
                        confidence);
}

Summary summarise(const std::vector<double>& values, bool higher_is_better) {
  check_finite(values, "value");
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  Summary summary;
  summary.count = sorted.size();
  summary.mean = std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(sorted.size());
  summary.median = quantile_of_sorted(sorted, 0.5);
  summary.lower_quartile = quantile_of_sorted(sorted, 0.25);
  summary.upper_quartile = quantile_of_sorted(sorted, 0.75);
  summary.percentile_95 = quantile_of_sorted(sorted, higher_is_better ? 0.05 : 0.95);
  summary.worst = higher_is_better ? sorted.front() : sorted.back();
  return summary;
}

std::vector<double> holm(const std::vector<double>& p_values) {
  for (std::size_t i = 0; i < p_values.size(); ++i)
    if (!(p_values[i] >= 0 && p_values[i] <= 1))
      throw Error(
          formatted("p-value {} of {} is {:f}; expected a number from 0 to 1", i + 1, p_values.size(), p_values[i]));
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<double> corrected(p_values.size());
  double largest = 0;  // a corrected p is never below that of a smaller p
  for (std::size_t k = 0; k < order.size(); ++k) {
    largest = std::max(largest, std::min(1.0, static_cast<double>(order.size() - k) * p_values[order[k]]));
    corrected[order[k]] = largest;
  }
  return corrected;
}

}  // namespace marrow::compare
