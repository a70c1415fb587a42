// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <marrow/base/error.hpp>
#include <marrow/compare/needed_cases.hpp>
#include <marrow/compare/paired.hpp>
#include <marrow/domain/random.hpp>

namespace needed_cases_test {

using namespace marrow::compare;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(NeededCases, SpreadIsTheStandardDeviationOfFiniteDifferences) {
  EXPECT_DOUBLE_EQ(*spread_of_differences({1, 2, 3, 4, kInfinite}), std::sqrt(5.0 / 3));
  EXPECT_EQ(spread_of_differences({1, 2, kInfinite}), std::nullopt);
  EXPECT_EQ(*spread_of_differences({2, 2, 2}), 0);
}

/// By scipy: p = norm.cdf(sqrt(3 n) (norm.cdf(sqrt(2) d) - 0.5) - norm.isf(0.05 / m / 2)), and the same of the signs
/// with 2 sqrt(n) (norm.cdf(d) - 0.5) - norm.isf(0.025); the smaller one, d in spreads.
TEST(NeededCases, OfScipy) {
  EXPECT_EQ(cases_to_show(0.3, 1), 142u);
  EXPECT_EQ(cases_to_show(0.5, 1), 54u);
  EXPECT_EQ(cases_to_show(1, 2), 54u);  // the same of another unit
  EXPECT_EQ(cases_to_show(1, 1), 17u);
  EXPECT_EQ(cases_to_show(0.3, 1, 6), 150u);
  EXPECT_EQ(cases_to_show(0.5, 1, 20), 74u);
  EXPECT_EQ(cases_to_show(3, 1, 20), 20u);
  EXPECT_EQ(cases_to_show(-0.5, 1), 54u);
}

TEST(NeededCases, ShowTheDifferenceInAboutSoManyExperiments) {
  struct Setting {
    double difference;
    std::size_t comparisons;
  };
  for (const auto& [difference, comparisons] : {Setting{0.3, 1}, {0.5, 1}, {0.5, 6}, {0.5, 20}, {1, 6}}) {
    const std::size_t cases = cases_to_show(difference, 1, comparisons).value();
    int shown = 0;
    for (std::uint64_t seed = 1; seed <= 500; ++seed) {
      marrow::Random random(seed);
      std::vector<Pair> pairs;
      for (std::size_t c = 0; c < cases; ++c) pairs.push_back({std::to_string(c), 0.0, difference + random.normal()});
      const Comparison comparison = compare_pairs(pairs, false);
      shown += difference_shown(comparison, std::min(1.0, double(comparisons) * comparison.test.p));
    }
    std::cout << "a difference of " << difference << " spreads among " << comparisons << ", " << cases
              << " cases: shown in " << shown << " of 500\n";
    EXPECT_GE(shown, 350);  // 70 %; of 500 with 76 % it is below 350 with a probability of 0.1 %
    EXPECT_LE(shown, 490);
  }
}

TEST(NeededCases, AndDifferencesBelongTogether) {
  const double least = difference_to_show(0.2, 54).value();
  EXPECT_NEAR(probability_to_show(least, 0.2, 54), 0.8, 1e-9);
  EXPECT_LE(least, 0.1);  // 54 are enough for half a spread
  EXPECT_GT(least, 0.099 * 0.98);
  EXPECT_EQ(difference_to_show(1, 5), std::nullopt);
  EXPECT_EQ(difference_to_show(1, 11, 20), std::nullopt);
  EXPECT_EQ(*difference_to_show(0, 12), 0);
  EXPECT_EQ(cases_to_show(1e-4, 1), std::nullopt);
  EXPECT_EQ(cases_to_show(0, 1), std::nullopt);
  EXPECT_EQ(probability_to_show(5, 1, 5), 0);
}

TEST(NeededCases, RefuseWhatIsNone) {
  const auto fault_of = [](auto call) -> std::string {
    try {
      call();
    } catch (const marrow::Error& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(fault_of([] { probability_to_show(1, -1, 20); }),
            "a difference of 1 with a spread of -1; expected two numbers, and a spread of 0 or more");
  EXPECT_EQ(fault_of([] { cases_to_show(1, 1, 1, 1); }),
            "the probability is 1; give a fraction between 0 and 1, such as 0.8");
  EXPECT_EQ(fault_of([] { cases_to_show(1, 1, 0); }), "there are no comparisons; give at least one");
}

}  // namespace needed_cases_test
