// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <iostream>
#include <marrow/compare/bootstrap.hpp>
#include <marrow/domain/quantile.hpp>
#include <marrow/domain/random.hpp>

#include "tests/framework/compare/intervals.hpp"
#include "tests/harness/message_of.hpp"

namespace bootstrap_test {

using namespace marrow::compare;
using intervals::bounds;

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
  for (const int threads : {0, 2, 3, 8})
    EXPECT_EQ(bounds(median_of_runs_interval(cases, {5, 0.95, 2000, threads})), bounds(runs));
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

using intervals::Bounds;

constexpr double infinite = std::numeric_limits<double>::infinity();

TEST(OrderStatisticInterval, IsThatOfTheBinomialDistribution) {
  // 2 P(fewer than 2 of 9 below) = 2 (1 + 9) / 512 = 0.0390625; with 3 it is 2 (1 + 9 + 36) / 512 = 0.18.
  const std::vector<double> values{9, 1, 8, 2, 7, 3, 6, 4, 5};
  for (const double level : {0.0390625, 0.05, 0.17}) {
    const Interval interval = order_statistic_interval(values, level + 1e-12);
    EXPECT_EQ(bounds(interval), Bounds(2, 8)) << level;
    EXPECT_NEAR(interval.confidence, 1 - level, 1e-9);
  }
  EXPECT_EQ(order_statistic_interval(values, 0.039).lower, 1) << "2 / 512 = 0.0039";
  EXPECT_EQ(bounds(order_statistic_interval(values, 0.003)), Bounds(-infinite, infinite));
}

TEST(OrderStatisticInterval, RefusesWhatHasNoMedian) {
  EXPECT_EQ(MESSAGE_OF(order_statistic_interval({}, 0.05)), "there are no values; give at least one");
  EXPECT_HAS(MESSAGE_OF(order_statistic_interval({1}, 0)), "between 0 and 1");
}

TEST(OrderStatisticInterval, MayEndInAFailure) {
  // With 6 values, the interval reaches from the smallest to the largest.
  EXPECT_EQ(bounds(order_statistic_interval({1, 2, 3, 4, 5, infinite}, 0.05)), Bounds(1, infinite));
  EXPECT_HAS(MESSAGE_OF(order_statistic_interval({1, std::numeric_limits<double>::quiet_NaN()}, 0.05)),
             "value 2 of 2 is nan");
}

/// `count` cases with these numbers of runs, in turn.
ValuesOfCases cases_of(std::size_t count, const std::vector<std::size_t>& runs) {
  marrow::Random random(4);
  ValuesOfCases cases(count);
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t r = 0; r < runs[c % runs.size()]; ++r) cases[c].push_back(random.normal());
  return cases;
}

TEST(MedianIntervalOf, NeedsAsManyCasesAsCanHoldIt) {
  // From the smallest to the largest of n values, the median is held with 1 - 2^(1 - n): 93.75 % for 5, 96.9 % for 6;
  // 98.4 % for 7, 99.2 % for 8.
  for (const std::vector<std::size_t>& runs : {std::vector<std::size_t>{1}, {3}, {1, 4}}) {
    EXPECT_FALSE(median_interval_of(cases_of(5, runs)));
    EXPECT_TRUE(median_interval_of(cases_of(6, runs)));
    EXPECT_FALSE(median_interval_of(cases_of(7, runs), 0.99));
    EXPECT_TRUE(median_interval_of(cases_of(8, runs), 0.99));
  }
  EXPECT_EQ(median_interval_of(cases_of(6, {1}))->confidence, 0.95);
}

TEST(MedianIntervalOf, IsThatOfOrderStatisticsForOneRunACaseAndResampledForSeveral) {
  EXPECT_EQ(bounds(*median_interval_of({{9}, {1}, {8}, {2}, {7}, {3}, {6}, {4}, {5}})), Bounds(2, 8));
  const ValuesOfCases cases = cases_of(9, {3});
  EXPECT_EQ(bounds(*median_interval_of(cases, 0.95, 7)), bounds(median_of_runs_interval(cases, {7})));
}

TEST(MedianIntervalOf, RefusesWhatHasNoMedian) {
  EXPECT_EQ(MESSAGE_OF(median_interval_of({})), "there are no values; give at least one");
  EXPECT_EQ(MESSAGE_OF(median_interval_of({{1}, {}})), "a case has no values; leave it out");
  EXPECT_HAS(MESSAGE_OF(median_interval_of({{1}, {infinite}})), "value 1 of 1 is inf");
  EXPECT_HAS(MESSAGE_OF(median_interval_of({{1}}, 95)), "0.95");
}

}  // namespace bootstrap_test
