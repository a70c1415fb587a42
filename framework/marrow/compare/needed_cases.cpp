// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/needed_cases.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/median_interval.hpp"
#include "marrow/compare/paired.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t kExperiments = 1000;

void check_probability(double probability) {
  if (!(probability > 0 && probability < 1))
    throw Error(formatted("the probability is {:g}; give a fraction between 0 and 1, such as 0.8", probability));
}

/// Whether the experiment of this number shows a difference, given in spreads. The same cases come first however many
/// there are, so that more of them or larger differences are shown more often.
bool is_shown(double size, std::size_t cases, std::size_t comparisons, double alpha, std::uint64_t number) {
  Random random(1, number);
  std::vector<double> differences(cases);
  for (double& one : differences) one = size + random.normal();
  Comparison comparison;
  comparison.test = signed_rank_test(differences);
  comparison.interval = order_statistic_interval(std::move(differences), alpha);
  return difference_shown(comparison, std::min(1.0, double(comparisons) * comparison.test.p), alpha);
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
  if (cases < fewest_cases(alpha, comparisons) || difference == 0) return 0;
  if (spread == 0) return 1;
  std::size_t shown = 0;
  for (std::size_t k = 0; k < kExperiments; ++k) shown += is_shown(difference / spread, cases, comparisons, alpha, k);
  return double(shown) / double(kExperiments);
}

std::optional<std::size_t> cases_to_show(double difference, double spread, std::size_t comparisons, double probability,
                                         double alpha) {
  check_probability(probability);
  const auto is_enough = [&](std::size_t cases) {
    return probability_to_show(difference, spread, cases, comparisons, alpha) >= probability;
  };
  std::size_t below = 0, enough = 1;
  while (!is_enough(enough)) {
    if (enough == kMostNeededCases) return std::nullopt;
    below = enough;
    enough = std::min(2 * enough, kMostNeededCases);
  }
  while (enough - below > 1) {
    const std::size_t middle = (below + enough) / 2;
    (is_enough(middle) ? enough : below) = middle;
  }
  return enough;
}

std::optional<double> difference_to_show(double spread, std::size_t cases, std::size_t comparisons, double probability,
                                         double alpha) {
  check_probability(probability);
  double below = 0, enough = 10 * spread;  // a normal variable lies as far from its mean with a probability of 1e-23
  if (probability_to_show(spread > 0 ? enough : 1, spread, cases, comparisons, alpha) < probability)
    return std::nullopt;
  for (int step = 0; step < 16 && spread > 0; ++step) {
    const double middle = 0.5 * (below + enough);
    (probability_to_show(middle, spread, cases, comparisons, alpha) >= probability ? enough : below) = middle;
  }
  return enough;
}

}  // namespace marrow::compare
