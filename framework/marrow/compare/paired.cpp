// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/paired.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/bootstrap.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::compare {
namespace {

constexpr double kRelativeNoise = 1e-9;

/// What the pairs of one case say.
struct CaseOfPairs {
  std::vector<double> differences;  ///< of the runs that both have
  double largest = 0;               ///< magnitude of the values that they come from
  std::size_t variant_lost = 0, reference_lost = 0;
};

struct NoisyDifference {
  double value = 0, noise = 0;
  bool operator<(const NoisyDifference& other) const {
    return std::pair(noise, std::abs(value)) < std::pair(other.noise, std::abs(other.value));
  }
};

void check_value(const Pair& pair, double value, const char* of) {
  if (!std::isfinite(value))
    throw Error(formatted(
        "case '{}': got {:f} for the {}, expected a finite number; give a run without a figure as one without a value",
        pair.case_name, value, of));
}

std::map<std::string, CaseOfPairs> pairs_by_case(const std::vector<Pair>& pairs, Tally& runs) {
  std::map<std::string, CaseOfPairs> cases;
  for (const Pair& pair : pairs) {
    CaseOfPairs& own = cases[pair.case_name];
    if (pair.reference) check_value(pair, *pair.reference, "reference");
    if (pair.variant) check_value(pair, *pair.variant, "variant");
    if (pair.reference && pair.variant) {
      own.differences.push_back(*pair.variant - *pair.reference);
      check_value(pair, own.differences.back(), "difference");
      own.largest = std::max({own.largest, std::abs(*pair.reference), std::abs(*pair.variant)});
      ++runs.both;
    } else if (pair.reference) {
      ++own.variant_lost;
      ++runs.variant_lost;
    } else if (pair.variant) {
      ++own.reference_lost;
      ++runs.reference_lost;
    } else {
      ++runs.neither;
    }
  }
  return cases;
}

NoisyDifference mean_difference(CaseOfPairs& own) {
  std::sort(own.differences.begin(), own.differences.end());  // a sum of doubles depends on its order
  const double sum = std::accumulate(own.differences.begin(), own.differences.end(), 0.0);
  return {sum / static_cast<double>(own.differences.size()), kRelativeNoise * own.largest};
}

/// Magnitudes that stand for all those within their noise.
class Magnitudes {
 public:
  /// 0 or else the nearest known one if it is within the noise; else the difference's own, which is known from now on.
  double of(const NoisyDifference& difference) {
    const double own = std::abs(difference.value);
    if (own <= difference.noise) return 0;
    const auto above = known_.lower_bound(own);
    double nearest = kInfinite;
    if (above != known_.end()) nearest = *above;
    if (above != known_.begin() && own - *std::prev(above) < nearest - own) nearest = *std::prev(above);
    if (std::abs(nearest - own) <= difference.noise) return nearest;
    known_.insert(own);
    return own;
  }

 private:
  std::set<double> known_;
};

/// The differences in their order, with those that only noise tells apart made equal.
std::vector<double> without_noise(const std::vector<NoisyDifference>& differences) {
  std::vector<std::size_t> order(differences.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return differences[a] < differences[b]; });
  Magnitudes magnitudes;
  std::vector<double> values(differences.size());
  for (const std::size_t i : order) {
    const double magnitude = magnitudes.of(differences[i]);
    values[i] = differences[i].value < 0 && magnitude > 0 ? -magnitude : magnitude;
  }
  return values;
}

/// By a sign test: twice the probability that the rarer of two equally likely outcomes is as rare as here or rarer.
int side_of_failures(const Tally& cases, bool larger_is_better, double alpha) {
  const auto [rarer, other] = std::minmax(cases.variant_lost, cases.reference_lost);
  if (rarer == other || 2 * incomplete_beta(double(other), double(rarer + 1), 0.5) >= alpha) return 0;
  return (cases.variant_lost > cases.reference_lost) == larger_is_better ? -1 : 1;
}

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

CaseDifferences case_differences(const std::vector<Pair>& pairs, bool larger_is_better) {
  CaseDifferences result;
  std::map<std::string, CaseOfPairs> cases = pairs_by_case(pairs, result.runs);
  std::vector<NoisyDifference> means;
  for (auto& [name, own] : cases)
    if (!own.differences.empty()) means.push_back(mean_difference(own));
  result.of_both = without_noise(means);
  const double worse = larger_is_better ? -kInfinite : kInfinite;
  std::size_t next = 0;  // in of_both
  for (const auto& [name, own] : cases) {
    const std::size_t place = own.differences.empty() ? next : next++;
    if (own.variant_lost != own.reference_lost) {
      const bool variant_worse = own.variant_lost > own.reference_lost;
      result.values.push_back(variant_worse ? worse : -worse);
      ++(variant_worse ? result.cases.variant_lost : result.cases.reference_lost);
    } else if (!own.differences.empty()) {
      result.values.push_back(result.of_both[place]);
      ++result.cases.both;
    } else {
      ++result.cases.neither;
    }
  }
  std::sort(result.values.begin(), result.values.end());
  std::sort(result.of_both.begin(), result.of_both.end());
  return result;
}

double median_of_differences(const std::vector<double>& sorted) {
  if (sorted.empty()) throw Error("there are no differences; give at least one");
  const QuantilePlace place = quantile_place(sorted.size(), 0.5);
  const double below = sorted[place.below], above = sorted[place.above];
  if (std::isfinite(below) && std::isfinite(above)) return std::lerp(below, above, place.part);
  return below == -above ? 0 : below + above;
}

Comparison compare_pairs(const std::vector<Pair>& pairs, bool larger_is_better, double confidence) {
  check_confidence(confidence);
  const CaseDifferences differences = case_differences(pairs, larger_is_better);
  Comparison comparison;
  comparison.runs = differences.runs;
  comparison.cases = differences.cases;
  comparison.interval = {-kInfinite, kInfinite, confidence};
  comparison.cases_of_both = differences.of_both.size();
  if (comparison.cases_of_both) comparison.median_of_both = median_of_differences(differences.of_both);
  if (differences.values.empty()) return comparison;
  comparison.median_difference = median_of_differences(differences.values);
  comparison.interval = order_statistic_interval(differences.values, 1 - confidence);
  comparison.interval.confidence = confidence;
  comparison.test = signed_rank_test(differences.values);
  comparison.side_of_failures = side_of_failures(comparison.cases, larger_is_better, 1 - confidence);
  return comparison;
}

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
