// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/needed_cases.hpp"

#include <algorithm>
#include <cmath>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/paired.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t kMostCases = 1000000;

void check_probability(double probability) {
  if (!(probability > 0 && probability < 1))
    throw Error(formatted("the probability is {:g}; give a fraction between 0 and 1, such as 0.8", probability));
}

}  // namespace

std::optional<double> spread_of_differences(const std::vector<double>& differences) {
  double sum = 0, squares = 0, count = 0;
  for (const double one : differences)
    if (std::isfinite(one)) {
      sum += one;
      ++count;
    }
  if (count < 3) return std::nullopt;
  for (const double one : differences)
    if (std::isfinite(one)) squares += (one - sum / count) * (one - sum / count);
  return std::sqrt(squares / (count - 1));
}

double probability_to_show(double difference, double spread, std::size_t cases, std::size_t comparisons, double alpha) {
  if (!(spread >= 0) || !std::isfinite(spread) || !std::isfinite(difference))
    throw Error(formatted("a difference of {:g} with a spread of {:g}; expected two numbers, and a spread of 0 or more",
                          difference, spread));
  if (cases < fewest_cases(alpha, comparisons)) return 0;
  if (difference == 0) return 0;
  const double size = spread > 0 ? std::abs(difference) / spread : kInfinite;
  const double n = double(cases);
  // How far the probability of a positive difference, and that of a positive sum of two, are from a half.
  const double of_one = 0.5 - upper_tail(size), of_two = 0.5 - upper_tail(std::sqrt(2.0) * size);
  const double ranks = std::sqrt(3 * n) * of_two - z_of_tail(alpha / double(comparisons) / 2);
  const double signs = 2 * std::sqrt(n) * of_one - z_of_tail(alpha / 2);
  return upper_tail(-std::min(ranks, signs));
}

std::optional<std::size_t> cases_to_show(double difference, double spread, std::size_t comparisons, double probability,
                                         double alpha) {
  check_probability(probability);
  const auto is_enough = [&](std::size_t cases) {
    return probability_to_show(difference, spread, cases, comparisons, alpha) >= probability;
  };
  std::size_t below = 0, enough = 1;  // it rises with the cases
  while (!is_enough(enough)) {
    below = enough;
    if ((enough *= 2) > 2 * kMostCases) return std::nullopt;
  }
  while (enough - below > 1) {
    const std::size_t middle = (below + enough) / 2;
    (is_enough(middle) ? enough : below) = middle;
  }
  return enough <= kMostCases ? std::optional(enough) : std::nullopt;
}

std::optional<double> difference_to_show(double spread, std::size_t cases, std::size_t comparisons, double probability,
                                         double alpha) {
  check_probability(probability);
  double below = 0, enough = 40 * spread;  // the tail beyond is below the smallest double
  if (probability_to_show(enough > 0 ? enough : 1, spread, cases, comparisons, alpha) < probability)
    return std::nullopt;
  for (int step = 0; step < 100; ++step) {
    const double middle = 0.5 * (below + enough);
    (probability_to_show(middle, spread, cases, comparisons, alpha) >= probability ? enough : below) = middle;
  }
  return enough;
}

}  // namespace marrow::compare
