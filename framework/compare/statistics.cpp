// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "marrow/compare/bootstrap.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/number_text.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"
#include "normal.hpp"
#include "value_checks.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t most_exact_cases = 50;

/// Ranks of the magnitudes in rising order. They are doubled, so that the mean rank of ties is an integer. Zeros take
/// the first ranks but are not listed.
struct Ranks {
  std::vector<std::size_t> doubled;  ///< doubled ranks of the differences that are not 0
  std::size_t zeros = 0;
  std::size_t doubled_positive = 0;  ///< sum over the positive differences
  double tie_term = 0;               ///< sum of t^3 - t over groups of t equal magnitudes that are not 0
};

Ranks signed_ranks(std::vector<double> differences) {
  std::sort(differences.begin(), differences.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  Ranks ranks;
  for (std::size_t first = 0, last = 0; first < differences.size(); first = last) {
    while (last < differences.size() && std::abs(differences[last]) == std::abs(differences[first])) ++last;
    if (differences[first] == 0) {
      ranks.zeros = last;
      continue;
    }
    const double ties = static_cast<double>(last - first);
    ranks.tie_term += ties * ties * ties - ties;
    const std::size_t doubled_rank = first + 1 + last;
    for (std::size_t i = first; i < last; ++i) {
      ranks.doubled.push_back(doubled_rank);
      if (differences[i] > 0) ranks.doubled_positive += doubled_rank;
    }
  }
  return ranks;
}

/// Two-sided p: twice the probability that the positive ranks add up to `doubled_smaller` / 2 or less if each sign is
/// equally likely.
double exact_p(const std::vector<std::size_t>& doubled_ranks, std::size_t doubled_smaller) {
  std::vector<double> chance(doubled_smaller + 1, 0.0);  // of each sum up to the observed one
  chance[0] = 1;
  for (const std::size_t rank : doubled_ranks)
    for (std::size_t sum = chance.size(); sum-- > 0;)
      chance[sum] = 0.5 * (chance[sum] + (sum >= rank ? chance[sum - rank] : 0.0));
  return std::min(1.0, 2 * std::accumulate(chance.begin(), chance.end(), 0.0));
}

double normal_p(const Ranks& ranks, double smaller) {
  const double zeros = static_cast<double>(ranks.zeros);
  const double n = zeros + static_cast<double>(ranks.doubled.size());
  const double mean = (n * (n + 1) - zeros * (zeros + 1)) / 4;
  const double variance = (n * (n + 1) * (2 * n + 1) - zeros * (zeros + 1) * (2 * zeros + 1) - ranks.tie_term / 2) / 24;
  const double distance = mean - smaller;
  return distance <= 0.5 ? 1.0 : std::min(1.0, 2 * upper_tail((distance - 0.5) / std::sqrt(variance)));
}

}  // namespace

Interval wilson_interval(std::size_t successes, std::size_t trials, double confidence) {
  check_confidence(confidence);
  if (trials == 0) throw Error("a success rate of no trials has no interval; give at least one trial");
  if (successes > trials)
    throw Error("got " + std::to_string(successes) + " successes of " + std::to_string(trials) +
                " trials; expected at most as many successes as trials");
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

namespace {

/// The differences of each case, sorted.
ValuesOfCases differences_of(const std::vector<Pair>& pairs) {
  if (pairs.empty()) throw Error("there are no pairs to compare; the variants need at least one case in common");
  std::map<std::string, std::vector<double>> by_case;
  for (const Pair& pair : pairs) {
    const double difference = pair.variant - pair.reference;
    if (!std::isfinite(difference))
      throw Error("case '" + pair.case_name + "': got " + formatted("%f", pair.reference) + " for the reference and " +
                  formatted("%f", pair.variant) +
                  " for the variant, expected finite numbers; count such a run as failed, and give the rest");
    by_case[pair.case_name].push_back(difference);
  }
  ValuesOfCases cases;
  for (auto& [name, differences] : by_case) {
    std::sort(differences.begin(), differences.end());  // a sum of doubles depends on its order
    cases.push_back(std::move(differences));
  }
  return cases;
}

std::vector<double> sorted_means(const ValuesOfCases& cases) {
  std::vector<double> means;
  for (const std::vector<double>& values : cases)
    means.push_back(std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()));
  std::sort(means.begin(), means.end());
  return means;
}

}  // namespace

std::vector<double> case_differences(const std::vector<Pair>& pairs) { return sorted_means(differences_of(pairs)); }

Interval median_interval(const std::vector<double>& differences, std::uint64_t seed, double confidence,
                         std::size_t resamples) {
  check_finite(differences, "difference");
  check_confidence(confidence);
  check_resamples(resamples);
  std::vector<double> sorted = differences;
  std::sort(sorted.begin(), sorted.end());
  Random random(seed);
  std::vector<double> drawn(sorted.size());
  std::vector<double> medians(resamples);
  for (double& median : medians) {
    for (double& value : drawn) value = sorted[random.index(sorted.size())];
    median = quantile_in_place(drawn, 0.5);
  }
  std::sort(medians.begin(), medians.end());
  return {quantile_of_sorted(medians, (1 - confidence) / 2), quantile_of_sorted(medians, (1 + confidence) / 2),
          confidence};
}

SignedRank signed_rank_test(const std::vector<double>& differences, SignedRankMethod method) {
  check_finite(differences, "difference");
  const Ranks ranks = signed_ranks(differences);
  const std::size_t doubled_total = std::accumulate(ranks.doubled.begin(), ranks.doubled.end(), std::size_t(0));
  const std::size_t doubled_smaller = std::min(ranks.doubled_positive, doubled_total - ranks.doubled_positive);
  SignedRank result;
  result.cases = differences.size();
  result.zeros = ranks.zeros;
  result.positive_ranks = 0.5 * static_cast<double>(ranks.doubled_positive);
  result.negative_ranks = 0.5 * static_cast<double>(doubled_total - ranks.doubled_positive);
  const bool few = ranks.doubled.size() <= most_exact_cases;
  if (method == SignedRankMethod::exact && !few)
    throw Error("the exact signed-rank test takes at most " + std::to_string(most_exact_cases) +
                " differences that are not 0, got " + std::to_string(ranks.doubled.size()) + "; use automatic");
  result.exact = method == SignedRankMethod::exact || (method == SignedRankMethod::automatic && few);
  result.p = result.exact ? exact_p(ranks.doubled, doubled_smaller)
                          : normal_p(ranks, 0.5 * static_cast<double>(doubled_smaller));
  return result;
}

std::vector<double> holm(const std::vector<double>& p_values) {
  for (std::size_t i = 0; i < p_values.size(); ++i)
    if (!(p_values[i] >= 0 && p_values[i] <= 1))
      throw Error("p-value " + std::to_string(i + 1) + " of " + std::to_string(p_values.size()) + " is " +
                  formatted("%f", p_values[i]) + "; expected a number from 0 to 1");
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

Comparison compare_pairs(const std::vector<Pair>& pairs, std::uint64_t seed, double confidence) {
  const ValuesOfCases cases = differences_of(pairs);
  const std::vector<double> differences = sorted_means(cases);
  Comparison comparison;
  comparison.cases = differences.size();
  comparison.pairs = pairs.size();
  comparison.median_difference = quantile_of_sorted(differences, 0.5);
  comparison.interval = median_of_case_means_interval(cases, {seed, confidence, resamples_for(pairs.size()), 0});
  comparison.test = signed_rank_test(differences);
  return comparison;
}

}  // namespace marrow::compare
