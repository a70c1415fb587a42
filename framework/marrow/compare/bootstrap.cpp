// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <thread>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::compare {
namespace {

ValuesOfCases checked_and_sorted(ValuesOfCases cases, const BootstrapSettings& settings) {
  if (cases.size() < 2) throw Error(formatted("an interval over cases needs at least two, got {}", cases.size()));
  for (std::vector<double>& values : cases) {
    if (values.empty()) throw Error("a case has no values; leave it out");
    check_finite(values, "value");
    std::sort(values.begin(), values.end());
  }
  check_confidence(settings.confidence);
  check_resamples(settings.resamples);
  std::sort(cases.begin(), cases.end());
  return cases;
}

/// The values of all resamples, each from its own random numbers. `make` is called once for each thread, and returns a
/// function with its own memory.
std::vector<double> of_resamples(const BootstrapSettings& settings,
                                 const std::function<std::function<double(Random&)>()>& make) {
  std::vector<double> results(settings.resamples);
  const std::size_t threads =
      settings.threads > 0 ? std::size_t(settings.threads) : std::max(1u, std::thread::hardware_concurrency());
  const auto work = [&](std::size_t first, std::size_t last) {
    const std::function<double(Random&)> one = make();
    for (std::size_t k = first; k < last; ++k) {
      Random random(settings.seed, k);
      results[k] = one(random);
    }
  };
  std::vector<std::jthread> others;
  for (std::size_t t = 1; t < threads; ++t)
    others.emplace_back(work, t * results.size() / threads, (t + 1) * results.size() / threads);
  work(0, results.size() / threads);
  others.clear();
  return results;
}

/// The share of resamples that lies beyond each bound of the expanded percentile interval.
double expanded_tail(double confidence, double cases) {
  return upper_tail(std::sqrt(cases / (cases - 1)) * student_quantile(1 - confidence, cases - 1));
}

/// Counts how often each value was drawn. Values are stored by rank, so counting up to the middle finds the median
/// without a sort. Blocks of ranks make this fast.
class DrawnRanks {
 public:
  explicit DrawnRanks(std::size_t ranks) : counts_(ranks), blocks_(ranks / kBlock + 1) {}

  void add(std::uint32_t rank) {
    ++counts_[rank];
    ++blocks_[rank / kBlock];
    ++drawn_;
  }
  /// Of the values in rising order. Forgets what was drawn.
  double take_median(const std::vector<double>& sorted) {
    const QuantilePlace place = quantile_place(drawn_, 0.5);
    const std::size_t lower = rank_at(place.below), upper = place.above > place.below ? rank_at(place.above) : lower;
    std::fill(counts_.begin(), counts_.end(), 0u);
    std::fill(blocks_.begin(), blocks_.end(), 0u);
    drawn_ = 0;
    return std::lerp(sorted[lower], sorted[upper], place.part);
  }

 private:
  static constexpr std::size_t kBlock = 64;

  /// The rank of the drawn value at this position, counted from 0.
  std::size_t rank_at(std::size_t position) const {
    std::size_t block = 0;
    while (position >= blocks_[block]) position -= blocks_[block++];
    std::size_t rank = block * kBlock;
    while (position >= counts_[rank]) position -= counts_[rank++];
    return rank;
  }

  std::vector<std::uint32_t> counts_, blocks_;
  std::size_t drawn_ = 0;
};

}  // namespace

std::size_t resamples_for(std::size_t runs) {
  return std::clamp<std::size_t>(std::size_t(1e9) / std::max<std::size_t>(runs, 1), 1000, 10000);
}

Interval median_of_runs_interval(const ValuesOfCases& given, const BootstrapSettings& settings) {
  const ValuesOfCases cases = checked_and_sorted(given, settings);
  std::vector<double> sorted;
  for (const std::vector<double>& values : cases) sorted.insert(sorted.end(), values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::vector<std::uint32_t>> ranks(cases.size());
  for (std::size_t c = 0; c < cases.size(); ++c)
    for (const double value : cases[c])
      ranks[c].push_back(std::uint32_t(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin()));
  std::vector<double> medians = of_resamples(settings, [&]() -> std::function<double(Random&)> {
    return [&, drawn = DrawnRanks(sorted.size())](Random& random) mutable {
      for (std::size_t i = 0; i < ranks.size(); ++i) {
        const std::vector<std::uint32_t>& own = ranks[random.index(ranks.size())];
        for (std::size_t k = 0; k < own.size(); ++k) drawn.add(own[random.index(own.size())]);
      }
      return drawn.take_median(sorted);
    };
  });
  std::sort(medians.begin(), medians.end());
  const double tail = expanded_tail(settings.confidence, double(cases.size()));
  return {quantile_of_sorted(medians, tail), quantile_of_sorted(medians, 1 - tail), settings.confidence};
}

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
