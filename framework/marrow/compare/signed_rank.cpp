// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/paired.hpp"
#include "value_checks.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t most_exact_cases = 50;
constexpr double kRelativeTie = 1e-9;

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
    const double largest = (1 + kRelativeTie) * std::abs(differences[first]);
    while (last < differences.size() && std::abs(differences[last]) <= largest) ++last;
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

SignedRank signed_rank_test(const std::vector<double>& differences, SignedRankMethod method) {
  check_numbers(differences, "difference");
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
    throw Error(
        formatted("the exact signed-rank test takes at most {} differences that are not 0, got {}; use automatic",
                  most_exact_cases, ranks.doubled.size()));
  result.exact = method == SignedRankMethod::exact || (method == SignedRankMethod::automatic && few);
  result.p = result.exact ? exact_p(ranks.doubled, doubled_smaller)
                          : normal_p(ranks, 0.5 * static_cast<double>(doubled_smaller));
  return result;
}

}  // namespace marrow::compare
