// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/paired.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/median_interval.hpp"
#include "marrow/domain/quantile.hpp"
#include "value_checks.hpp"

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

}  // namespace marrow::compare
