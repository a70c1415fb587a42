// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <marrow/compare/needed_cases.hpp>

#include "tests/harness/message_of.hpp"

namespace needed_cases_test {

using namespace marrow::compare;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(NeededCases, SpreadIsTheStandardDeviationOfFiniteDifferences) {
  EXPECT_DOUBLE_EQ(*spread_of_differences({1, 2, 3, 4, kInfinite}), std::sqrt(5.0 / 3));
  EXPECT_EQ(spread_of_differences({1, 2, kInfinite}), std::nullopt);
  EXPECT_EQ(*spread_of_differences({2, 2, 2}), 0);
}

/// Of 1000 experiments by numpy's random numbers and scipy.stats.wilcoxon; two such shares differ by less than 0.06
/// (3.2 deviations).
TEST(NeededCases, ProbabilitiesAsByScipy) {
  EXPECT_NEAR(probability_to_show(0.3, 1, 142), 0.756, 0.06);
  EXPECT_NEAR(probability_to_show(0.5, 1, 54), 0.796, 0.06);
  EXPECT_NEAR(probability_to_show(-1, 2, 54), 0.796, 0.06);  // to the other side, in another unit
  EXPECT_NEAR(probability_to_show(1, 1, 17), 0.866, 0.06);
  EXPECT_NEAR(probability_to_show(0.5, 1, 60, 6), 0.769, 0.06);
  EXPECT_NEAR(probability_to_show(1, 1, 23, 6), 0.925, 0.06);
  EXPECT_NEAR(probability_to_show(0.5, 1, 74, 20), 0.827, 0.06);
}

/// Eight cases show a difference only if all agree: the interval goes from the smallest to the largest. By scipy:
/// norm.cdf(d)**8, and norm.ppf(0.8**(1/8)) = 1.918.
TEST(NeededCases, EightCasesMustAllAgree) {
  EXPECT_NEAR(probability_to_show(1, 1, 8), 0.2510, 0.045);
  EXPECT_NEAR(probability_to_show(2, 1, 8), 0.8318, 0.04);
  EXPECT_NEAR(*difference_to_show(1, 8), 1.918, 0.12);
  EXPECT_NEAR(*difference_to_show(0.1, 8), 0.1918, 0.012);
}

TEST(NeededCases, AndDifferencesBelongTogether) {
  const std::size_t cases = cases_to_show(0.1, 0.2).value();
  EXPECT_GE(probability_to_show(0.1, 0.2, cases), 0.8);
  EXPECT_LT(probability_to_show(0.1, 0.2, cases - 1), 0.8);
  EXPECT_LE(difference_to_show(0.2, cases).value(), 0.1);
  EXPECT_GT(difference_to_show(0.2, cases - 1).value(), 0.1);
  EXPECT_EQ(difference_to_show(1, 5), std::nullopt);
  EXPECT_EQ(difference_to_show(1, 9, 20), std::nullopt);  // it takes 10
  EXPECT_TRUE(difference_to_show(1, 10, 20));
  EXPECT_EQ(*difference_to_show(0, 12), 0);
  EXPECT_EQ(cases_to_show(0.01, 1), std::nullopt);
  EXPECT_EQ(cases_to_show(0, 1), std::nullopt);
  EXPECT_EQ(cases_to_show(5, 1), 6u);
  EXPECT_EQ(probability_to_show(5, 1, 5), 0);
}

TEST(NeededCases, RefuseWhatIsNone) {
  EXPECT_EQ(MESSAGE_OF(probability_to_show(1, -1, 20)),
            "a difference of 1 with a spread of -1; expected two numbers, and a spread of 0 or more");
  EXPECT_EQ(MESSAGE_OF(cases_to_show(1, 1, 1, 1)),
            "the probability is 1; give a fraction between 0 and 1, such as 0.8");
  EXPECT_EQ(MESSAGE_OF(cases_to_show(1, 1, 0)), "there are no comparisons; give at least one");
}

}  // namespace needed_cases_test
