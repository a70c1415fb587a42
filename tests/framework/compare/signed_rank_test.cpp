// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <marrow/compare/paired.hpp>

#include "tests/harness/message_of.hpp"

namespace signed_rank_test_suite {

using namespace marrow::compare;

constexpr double infinite = std::numeric_limits<double>::infinity();

TEST(SignedRank, IsTheTable) {
  // Of the 2^6 = 64 signs, one gives W = 0 and one W = 1: p = 2/64 and 4/64. W = 2 is {2} only, W = 3 is {3} and {1,
  // 2}.
  EXPECT_DOUBLE_EQ(signed_rank_test({1, 2, 3, 4, 5, 6}).p, 2.0 / 64);
  EXPECT_DOUBLE_EQ(signed_rank_test({-1, 2, 3, 4, 5, 6}).p, 4.0 / 64);
  EXPECT_DOUBLE_EQ(signed_rank_test({1, 2, -3, 4, 5, 6}).p, 10.0 / 64);
  const SignedRank test = signed_rank_test({1, -2, -3, -4, -5, -6});
  EXPECT_EQ(test.positive_ranks, 1);
  EXPECT_EQ(test.negative_ranks, 20);
  EXPECT_DOUBLE_EQ(test.p, 4.0 / 64);
  EXPECT_TRUE(test.exact);
}

TEST(SignedRank, OfOneCaseSaysNothing) { EXPECT_EQ(signed_rank_test({5}).p, 1); }

TEST(SignedRank, TiesKeepTheExactDistribution) {
  // Five equal differences: all ranks 3, so only the signs count: 2/32, where the approximation has 0.0369.
  EXPECT_DOUBLE_EQ(signed_rank_test({2, 2, 2, 2, 2}).p, 2.0 / 32);
  EXPECT_NEAR(signed_rank_test({2, 2, 2, 2, 2}, SignedRankMethod::normal).p, 0.0369, 1e-4);
  // Ranks 1.5 1.5 3 4, negative 1.5: sums up to 1.5 are {}, {first}, {second}: 2 * 3/16.
  EXPECT_DOUBLE_EQ(signed_rank_test({-1, 1, 2, 3}).p, 6.0 / 16);
}

TEST(SignedRank, ZerosAreRankedAndThenLeftOut) {
  // |d| = 0 1 2 3, ranks 1 2 3 4; the negative one has rank 2 of {2, 3, 4}: sums up to 2 are {} and {2}: 2 * 2/8.
  const SignedRank test = signed_rank_test({0, -1, 2, 3});
  EXPECT_EQ(test.cases, 4u);
  EXPECT_EQ(test.zeros, 1u);
  EXPECT_EQ(test.negative_ranks, 2);
  EXPECT_EQ(test.positive_ranks, 7);
  EXPECT_DOUBLE_EQ(test.p, 4.0 / 8);
  EXPECT_EQ(signed_rank_test({0, 0, 0}).p, 1);
  EXPECT_EQ(signed_rank_test({0, 0, 0}, SignedRankMethod::normal).p, 1);
}

TEST(SignedRank, ManyCasesUseTheApproximation) {
  std::vector<double> differences;
  for (int i = 1; i <= 51; ++i) differences.push_back(i % 3 ? i : -i);
  const SignedRank test = signed_rank_test(differences);
  // Multiples of 3 up to 51 add up to 459; mean 663, variance 51 * 52 * 103 / 24 = 11381.5: z = 203.5 / 106.684.
  EXPECT_FALSE(test.exact);
  EXPECT_EQ(test.negative_ranks, 459);
  EXPECT_NEAR(test.p, 0.05646, 1e-4);
  EXPECT_HAS(MESSAGE_OF(signed_rank_test(differences, SignedRankMethod::exact)), "at most 50");
}

TEST(SignedRank, RefusesNaN) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_HAS(MESSAGE_OF(signed_rank_test({1, nan})), "difference 2 of 2 is nan");
  EXPECT_HAS(MESSAGE_OF(signed_rank_test({})), "no differences");
}

TEST(SignedRank, FailuresShareTheHighestRank) {
  // Ranks 1, 2 and, for the three failures, (3 + 4 + 5) / 3 = 4; negative 4: of 32 assignments, sums up to 4 are {},
  // {1}, {2}, {1, 2} and each of the three 4s: 2 * 7/32.
  const SignedRank test = signed_rank_test({1, 2, infinite, infinite, -infinite});
  EXPECT_EQ(test.negative_ranks, 4);
  EXPECT_EQ(test.positive_ranks, 11);
  EXPECT_DOUBLE_EQ(test.p, 14.0 / 32);
  EXPECT_DOUBLE_EQ(signed_rank_test({infinite, infinite, infinite, infinite, infinite, infinite}).p, 2.0 / 64);
}

TEST(SignedRank, TiesAreThoseUpToTheLastDigits) {
  // 0.1 * 3 is 0.30000000000000004.
  EXPECT_EQ(signed_rank_test({0.1 * 3, -0.3, 1}).positive_ranks, 4.5);
  EXPECT_EQ(signed_rank_test({0.3 * (1 + 1e-8), -0.3, 1}).positive_ranks, 5) << "the two magnitudes are not tied";
  EXPECT_EQ(signed_rank_test({1e-7, -2e-7, 1e6}).positive_ranks, 4) << "an outlier does not tie the others";
}

}  // namespace signed_rank_test_suite
