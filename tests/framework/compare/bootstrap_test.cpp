// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <limits>
#include <marrow/compare/bootstrap.hpp>
#include <marrow/domain/quantile.hpp>
#include <marrow/domain/random.hpp>

#include "tests/harness/message_of.hpp"

namespace bootstrap_test {

using namespace marrow::compare;

/// Runs that scatter around their case by `within`, and cases around 0 by `between`.
ValuesOfCases cases_of(std::size_t cases, std::size_t starts, double between, double within, std::uint64_t seed) {
  marrow::Random random(seed);
  ValuesOfCases values(cases);
  for (std::vector<double>& own : values) {
    const double of_case = between * random.normal();
    for (std::size_t s = 0; s < starts; ++s) own.push_back(of_case + within * random.normal());
  }
  return values;
}

void expect_same(const Interval& got, const Interval& expected) {
  EXPECT_EQ(got.lower, expected.lower);
  EXPECT_EQ(got.upper, expected.upper);
}

TEST(Bootstrap, IsThatOfTheDefinition) {
  const ValuesOfCases cases{{1, 5, 2}, {3, 4}, {7}};
  const std::vector<std::vector<double>> sorted{{1, 2, 5}, {3, 4}, {7}};
  std::vector<double> medians;
  for (std::size_t k = 0; k < 1000; ++k) {
    marrow::Random random(9, k);
    std::vector<double> drawn;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::vector<double>& own = sorted[random.index(3)];
      for (std::size_t s = 0; s < own.size(); ++s) drawn.push_back(own[random.index(own.size())]);
    }
    medians.push_back(summarise(drawn).median);
  }
  // Student's t with 2 degrees of freedom is 2.919986 or less in 95 % of cases. Times sqrt(3 / 2), it is 3.576237,
  // which a normal variable exceeds with the probability 0.000174287 (scipy.stats.t and norm).
  const Interval interval = median_of_runs_interval(cases, {9, 0.9, 1000, 1});
  EXPECT_NEAR(interval.lower, marrow::quantile(medians, 0.000174287), 1e-6);
  EXPECT_NEAR(interval.upper, marrow::quantile(medians, 1 - 0.000174287), 1e-6);
  EXPECT_EQ(interval.confidence, 0.9);
}

TEST(Bootstrap, ItsExpansionVanishesWithManyCases) {
  // With 2000 cases the share beyond each bound is 0.02490 instead of 0.025 (scipy.stats, as above).
  const ValuesOfCases cases = cases_of(2000, 2, 1, 1, 5);
  const Interval interval = median_of_runs_interval(cases, {1, 0.95, 1000, 0}),
                 wider = median_of_runs_interval(cases, {1, 0.96, 1000, 0});
  EXPECT_LT(interval.upper - interval.lower, wider.upper - wider.lower);
}

TEST(Bootstrap, IsTheSameWithAnyNumberOfThreadsAndInAnyOrder) {
  ValuesOfCases cases = cases_of(40, 7, 1, 1, 3);
  const Interval runs = median_of_runs_interval(cases, {5, 0.95, 2000, 1});
  std::reverse(cases.begin(), cases.end());
  for (std::vector<double>& own : cases) std::reverse(own.begin(), own.end());
  for (const int threads : {0, 2, 3, 8}) expect_same(median_of_runs_interval(cases, {5, 0.95, 2000, threads}), runs);
}

TEST(Bootstrap, StartsAreNoCases) {
  // All runs of a case are equal: 200 runs say no more than the 20 cases.
  ValuesOfCases few = cases_of(20, 1, 1, 0, 6), many = few;
  for (std::vector<double>& own : many) own.resize(10, own[0]);
  const auto width = [](const Interval& interval) { return interval.upper - interval.lower; };
  const double alike = width(median_of_runs_interval(many)), once = width(median_of_runs_interval(few));
  EXPECT_NEAR(alike / once, 1, 0.1);
  ValuesOfCases apart;
  for (const std::vector<double>& own : many) apart.insert(apart.end(), own.size(), {own[0]});
  EXPECT_LT(width(median_of_runs_interval(apart)), 0.5 * alike);
}

TEST(Bootstrap, RefusesWhatHasNoMedian) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(MESSAGE_OF(median_of_runs_interval({})), "an interval over cases needs at least two, got 0");
  EXPECT_EQ(MESSAGE_OF(median_of_runs_interval({{1, 2}})), "an interval over cases needs at least two, got 1");
  EXPECT_EQ(MESSAGE_OF(median_of_runs_interval({{1}, {}})), "a case has no values; leave it out");
  EXPECT_HAS(MESSAGE_OF(median_of_runs_interval({{1, nan}, {1}})), "value 2 of 2 is");
  EXPECT_HAS(MESSAGE_OF(median_of_runs_interval({{1}, {2}}, {1, 2})), "0.95");
  EXPECT_HAS(MESSAGE_OF(median_of_runs_interval({{1}, {2}}, {1, 0.95, 10})), "at least 1000");
}

TEST(Bootstrap, TakesSecondsForTenThousandCells) {
  const ValuesOfCases cases = cases_of(1000, 10, 1, 1, 8);
  const auto begin = std::chrono::steady_clock::now();
  const Interval interval = median_of_runs_interval(cases, {1, 0.95, 10000, 1});
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::cout << "10,000 cells, 10,000 resamples, one thread: " << seconds << " s\n";
  EXPECT_LT(interval.lower, interval.upper);
  EXPECT_LT(seconds, 60) << "it takes below 2 s on an idle machine";
}

}  // namespace bootstrap_test
