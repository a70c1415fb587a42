// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/quantile.hpp"

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

namespace {

constexpr double kFarthestZ = 40;  // its tail is below the smallest double

/// Not by long double: the levels of looks take millions of its tails.
using Normal =
    boost::math::normal_distribution<double,
                                     boost::math::policies::policy<boost::math::policies::promote_double<false>>>;

void check_each(const std::vector<double>& values, const std::string& what, bool may_be_infinite) {
  if (values.empty()) throw Error("there are no " + what + "s; give at least one");
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isnan(values[i]) || (std::isinf(values[i]) && !may_be_infinite))
      throw Error(
          formatted("{} {} of {} is {:f}, which is no number to compare; count its run as failed, and give the rest",
                    what, i + 1, values.size(), values[i]));
}

using Group = std::vector<std::size_t>;  // sorted

constexpr std::size_t kLetters = 26;
constexpr std::size_t kMostGroups = 1000;  // before all pairs are looked at; later ones may make fewer of them

bool is_within(const Group& group, const std::vector<Group>& others) {
  return std::any_of(others.begin(), others.end(), [&](const Group& other) {
    return std::includes(other.begin(), other.end(), group.begin(), group.end());
  });
}

/// Divides the groups that hold both of a pair that differs. Those that another group holds are left out.
std::vector<Group> divided(const std::vector<Group>& groups, std::size_t one, std::size_t other) {
  std::vector<Group> kept, parts;
  for (const Group& group : groups) {
    const bool has_both =
        std::binary_search(group.begin(), group.end(), one) && std::binary_search(group.begin(), group.end(), other);
    if (!has_both) {
      kept.push_back(group);
      continue;
    }
    for (const std::size_t without : {one, other}) {
      parts.push_back(group);
      std::erase(parts.back(), without);
    }
  }
  // Larger parts first: a part can only lie within one that is not smaller.
  std::stable_sort(parts.begin(), parts.end(), [](const Group& a, const Group& b) { return a.size() > b.size(); });
  for (Group& part : parts)
    if (!is_within(part, kept)) kept.push_back(std::move(part));
  return kept;
}

}  // namespace

double incomplete_beta(double a, double b, double x) {
  if (x <= 0 || x >= 1) return x <= 0 ? 0 : 1;
  return boost::math::cdf(boost::math::beta_distribution<>(a, b), x);
}

double beta_quantile(double p, double a, double b) {
  return boost::math::quantile(boost::math::beta_distribution<>(a, b), p);
}

double student_quantile(double outside, double freedom) {
  return boost::math::quantile(boost::math::complement(boost::math::students_t_distribution<>(freedom), outside / 2));
}

double upper_tail(double z) { return boost::math::cdf(boost::math::complement(Normal(), z)); }

double z_of_tail(double tail) {
  if (tail <= upper_tail(kFarthestZ)) return kFarthestZ;
  return boost::math::quantile(boost::math::complement(Normal(), tail));
}

Interval score_interval(double rate, double runs, double confidence) {
  const double z = z_of_tail((1 - confidence) / 2);
  const double centre = (rate + z * z / (2 * runs)) / (1 + z * z / runs);
  const double half = z / (1 + z * z / runs) * std::sqrt(rate * (1 - rate) / runs + z * z / (4 * runs * runs));
  // With no successes the lower bound is exactly 0, and with all successes the upper bound is exactly 1. Rounding would
  // miss this.
  return {rate == 0 ? 0.0 : centre - half, rate == 1 ? 1.0 : centre + half, confidence};
}

void check_finite(const std::vector<double>& values, const std::string& what) { check_each(values, what, false); }

void check_numbers(const std::vector<double>& values, const std::string& what) { check_each(values, what, true); }

void check_confidence(double confidence) {
  if (!(confidence > 0 && confidence < 1))
    throw Error(formatted("the confidence is {:f}; give a fraction between 0 and 1, such as 0.95", confidence));
}

void check_resamples(std::size_t resamples) {
  if (resamples < 1000)
    throw Error(formatted("got {} resamples; the bounds need at least 1000 (10000 is the default)", resamples));
}

std::optional<std::vector<std::string>> letters_of_groups(
    std::size_t things, const std::vector<std::pair<std::size_t, std::size_t>>& different) {
  Group all(things);
  for (std::size_t i = 0; i < things; ++i) all[i] = i;
  std::vector<Group> groups{all};
  for (const auto& [one, other] : different) {
    if (one >= things || other >= things || one == other)
      throw Error(formatted("the pair {} and {} of {} things cannot differ; give two of them, counted from 0", one,
                            other, things));
    groups = divided(groups, one, other);
    if (groups.size() > kMostGroups) return std::nullopt;
  }
  if (groups.size() > kLetters) return std::nullopt;
  std::sort(groups.begin(), groups.end());
  std::vector<std::string> letters(things);
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const std::size_t thing : groups[g]) letters[thing] += char('a' + g);
  return letters;
}

}  // namespace marrow::compare
