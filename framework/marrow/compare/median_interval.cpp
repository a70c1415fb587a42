// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/median_interval.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "value_checks.hpp"

namespace marrow::compare {

Interval order_statistic_interval(std::vector<double> values, double level) {
  check_numbers(values, "value");
  if (!(level > 0 && level < 1))
    throw Error(formatted("the level is {:f}; give a fraction between 0 and 1, such as 0.05", level));
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  // Twice the probability that fewer than j of n values are below the median; its terms are those of a fair coin.
  double tail = 0, log_term = -double(n) * std::numbers::ln2;
  std::size_t j = 0;
  while (j < n && tail + 2 * std::exp(log_term) <= level) {
    tail += 2 * std::exp(log_term);
    log_term += std::log(double(n - j) / double(j + 1));
    ++j;
  }
  if (!j) return {-kInfinite, kInfinite, 1 - level};
  return {values[j - 1], values[n - j], 1 - level};
}

std::optional<Interval> median_interval_of(const ValuesOfCases& cases, double confidence, std::uint64_t seed) {
  check_confidence(confidence);
  std::vector<double> first;
  std::size_t runs = 0;
  for (const std::vector<double>& values : cases) {
    if (values.empty()) throw Error("a case has no values; leave it out");
    check_finite(values, "value");
    first.push_back(values[0]);
    runs += values.size();
  }
  // The interval of one run of each case. If its bounds are infinite, so few cases give no interval of this confidence.
  Interval of_first = order_statistic_interval(std::move(first), 1 - confidence);
  if (!std::isfinite(of_first.lower)) return std::nullopt;
  of_first.confidence = confidence;
  if (runs == cases.size()) return of_first;
  return median_of_runs_interval(cases, {seed, confidence, resamples_for(runs), 0});
}

}  // namespace marrow::compare
