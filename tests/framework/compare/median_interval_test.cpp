// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <marrow/compare/median_interval.hpp>
#include <marrow/domain/random.hpp>

#include "tests/harness/message_of.hpp"

namespace median_interval_test {

using namespace marrow::compare;

constexpr double infinite = std::numeric_limits<double>::infinity();

TEST(OrderStatisticInterval, IsThatOfTheBinomialDistribution) {
  // 2 P(fewer than 2 of 9 below) = 2 (1 + 9) / 512 = 0.0390625; with 3 it is 2 (1 + 9 + 36) / 512 = 0.18.
  const std::vector<double> values{9, 1, 8, 2, 7, 3, 6, 4, 5};
  for (const double level : {0.0390625, 0.05, 0.17}) {
    const Interval interval = order_statistic_interval(values, level + 1e-12);
    EXPECT_EQ(interval.lower, 2) << level;
    EXPECT_EQ(interval.upper, 8) << level;
    EXPECT_NEAR(interval.confidence, 1 - level, 1e-9);
  }
  EXPECT_EQ(order_statistic_interval(values, 0.039).lower, 1) << "2 / 512 = 0.0039";
  EXPECT_EQ(order_statistic_interval(values, 0.003).lower, -std::numeric_limits<double>::infinity());
  EXPECT_EQ(order_statistic_interval(values, 0.003).upper, std::numeric_limits<double>::infinity());
}

TEST(OrderStatisticInterval, RefusesWhatHasNoMedian) {
  EXPECT_EQ(MESSAGE_OF(order_statistic_interval({}, 0.05)), "there are no values; give at least one");
  EXPECT_HAS(MESSAGE_OF(order_statistic_interval({1}, 0)), "between 0 and 1");
}

TEST(OrderStatisticInterval, MayEndInAFailure) {
  // With 6 values, the interval reaches from the smallest to the largest.
  const Interval interval = order_statistic_interval({1, 2, 3, 4, 5, infinite}, 0.05);
  EXPECT_EQ(interval.lower, 1);
  EXPECT_EQ(interval.upper, infinite);
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

TEST(MedianIntervalOf, OneRunACaseIsThatOfOrderStatistics) {
  const Interval interval = *median_interval_of({{9}, {1}, {8}, {2}, {7}, {3}, {6}, {4}, {5}});
  EXPECT_EQ(interval.lower, 2);
  EXPECT_EQ(interval.upper, 8);
}

TEST(MedianIntervalOf, SeveralRunsACaseAreResampled) {
  const ValuesOfCases cases = cases_of(9, {3});
  const Interval interval = *median_interval_of(cases, 0.95, 7), expected = median_of_runs_interval(cases, {7});
  EXPECT_EQ(interval.lower, expected.lower);
  EXPECT_EQ(interval.upper, expected.upper);
}

TEST(MedianIntervalOf, RefusesWhatHasNoMedian) {
  EXPECT_EQ(MESSAGE_OF(median_interval_of({})), "there are no values; give at least one");
  EXPECT_EQ(MESSAGE_OF(median_interval_of({{1}, {}})), "a case has no values; leave it out");
  EXPECT_HAS(MESSAGE_OF(median_interval_of({{1}, {infinite}})), "value 1 of 1 is inf");
  EXPECT_HAS(MESSAGE_OF(median_interval_of({{1}}, 95)), "0.95");
}

}  // namespace median_interval_test
