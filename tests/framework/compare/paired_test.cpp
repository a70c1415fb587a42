// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <marrow/compare/paired.hpp>
#include <marrow/domain/random.hpp>

#include "tests/harness/message_of.hpp"

namespace paired_test {

using namespace marrow::compare;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr std::nullopt_t failed = std::nullopt;

std::vector<double> values_of(const std::vector<Pair>& pairs, bool larger_is_better = false) {
  return case_differences(pairs, larger_is_better).values;
}

TEST(CaseDifferences, DoNotDependOnTheOrderOfThePairs) {
  EXPECT_EQ(values_of({{"b", 1, 1.5}, {"a", 1, 3}, {"a", 2, 6}, {"a", 0, 0}}), (std::vector<double>{0.5, 2}));
  std::vector<Pair> pairs;
  for (int i = 0; i < 60; ++i) pairs.push_back({"case " + std::to_string(i % 7), 0.1 * i, std::sin(i) * 1e3});
  const Comparison comparison = compare_pairs(pairs, false);
  std::reverse(pairs.begin(), pairs.end());
  const Comparison reversed = compare_pairs(pairs, false);
  EXPECT_EQ(comparison.compared(), 7u);
  EXPECT_EQ(comparison.runs.both, 60u);
  EXPECT_EQ(comparison.median_difference, reversed.median_difference);
  EXPECT_EQ(comparison.interval.lower, reversed.interval.lower);
  EXPECT_EQ(comparison.interval.upper, reversed.interval.upper);
  EXPECT_EQ(comparison.test.p, reversed.test.p);
}

TEST(CaseDifferences, NameTheCaseThatIsNotFinite) {
  EXPECT_EQ(MESSAGE_OF(values_of({{"left", 1, 2}, {"right", 1, nan}})),
            "case 'right': got nan for the variant, expected a finite number; give a run without a figure as one "
            "without a value");
  EXPECT_HAS(MESSAGE_OF(values_of({{"right", infinite, failed}})), "got inf for the reference");
  EXPECT_HAS(MESSAGE_OF(values_of({{"right", -1e308, 1e308}})), "got inf for the difference");
}

TEST(CaseDifferences, FailuresDecideBeforeValues) {
  // a: the variant lost one run more. b: the reference lost one run more. c: each lost one, so the run that both have
  // decides. d: both lost all runs. e: each lost one, and they have no run in common.
  const std::vector<Pair> pairs{{"a", 1, failed},      {"a", 5, 1},      {"b", failed, 1},
                                {"c", 1, failed},      {"c", failed, 1}, {"c", 1, 3},
                                {"d", failed, failed}, {"e", 1, failed}, {"e", failed, 9}};
  const CaseDifferences lower = case_differences(pairs, false), higher = case_differences(pairs, true);
  EXPECT_EQ(lower.values, (std::vector<double>{-infinite, 2, infinite}));
  EXPECT_EQ(higher.values, (std::vector<double>{-infinite, 2, infinite})) << "a and b change places";
  EXPECT_EQ(lower.of_both, (std::vector<double>{-4, 2})) << "a and c";
  EXPECT_EQ(values_of({{"a", 1, failed}}, false), (std::vector<double>{infinite}));
  EXPECT_EQ(values_of({{"a", 1, failed}}, true), (std::vector<double>{-infinite}));
  EXPECT_EQ(lower.runs.both, 2u);
  EXPECT_EQ(lower.runs.variant_lost, 3u);
  EXPECT_EQ(lower.runs.reference_lost, 3u);
  EXPECT_EQ(lower.runs.neither, 1u);
  EXPECT_EQ(lower.cases.both, 1u);
  EXPECT_EQ(lower.cases.variant_lost, 1u);
  EXPECT_EQ(lower.cases.reference_lost, 1u);
  EXPECT_EQ(lower.cases.neither, 2u);
}

/// 30 cases. The variant fails in some, and is 0.2 better in the others.
Comparison failing_in(int failures) {
  std::vector<Pair> pairs;
  for (int c = 0; c < 30; ++c)
    pairs.push_back({"case " + std::to_string(c), 1.0, c < failures ? std::nullopt : std::optional(0.8)});
  return compare_pairs(pairs, false);
}

TEST(ComparePairs, CountsAVariantThatLosesTheHardCasesAsWorse) {
  // The failures have the top ranks, so the 8 others have the sum 1 + ... + 8 = 36. With 30 values, the interval is
  // from the 10th to the 21st, because 2 P(fewer than 10 of 30 are below) = 0.043.
  const Comparison comparison = failing_in(22);
  EXPECT_EQ(comparison.median_difference, infinite);
  EXPECT_EQ(comparison.interval.lower, infinite);
  EXPECT_EQ(comparison.test.negative_ranks, 36);
  EXPECT_LT(comparison.test.p, 0.001);
  EXPECT_TRUE(difference_shown(comparison, comparison.test.p));
  EXPECT_EQ(comparison.cases_of_both, 8u);
  EXPECT_DOUBLE_EQ(*comparison.median_of_both, -0.2);
}

TEST(ComparePairs, ShowsByFailuresWhatTheMedianLeavesOpen) {
  // 10 better and 20 lost: the 10th value is still one of those that are better, so the interval contains 0. But in all
  // 20 cases in which one lost more, it was the variant: p = 2^-19 by a sign test.
  const Comparison comparison = failing_in(20);
  EXPECT_EQ(comparison.median_difference, infinite);
  EXPECT_DOUBLE_EQ(comparison.interval.lower, -0.2);
  EXPECT_LT(comparison.test.p, 0.001);
  EXPECT_EQ(comparison.side_of_failures, 1);
  EXPECT_TRUE(difference_shown(comparison, comparison.test.p));
}

TEST(ComparePairs, FailuresShowASideWhereASignTestDoes) {
  // Two-sided p of k against n, by hand: 5 against 0 is 2 / 2^5 = 0.0625, 6 against 0 is 2 / 2^6 = 0.03125; 1 against 8
  // is 2 * (1 + 9) / 2^9 = 0.0391, 1 against 7 is 2 * (1 + 8) / 2^8 = 0.0703.
  const auto side = [](int variant, int baseline, bool larger_is_better) {
    std::vector<Pair> pairs;
    for (int c = 0; c < variant; ++c) pairs.push_back({"v" + std::to_string(c), 1.0, failed});
    for (int c = 0; c < baseline; ++c) pairs.push_back({"b" + std::to_string(c), failed, 1.0});
    for (int c = 0; c < 20; ++c) pairs.push_back({"both " + std::to_string(c), 1.0, 1.0});
    return compare_pairs(pairs, larger_is_better).side_of_failures;
  };
  EXPECT_EQ(side(5, 0, false), 0);
  EXPECT_EQ(side(6, 0, false), 1);
  EXPECT_EQ(side(6, 0, true), -1);
  EXPECT_EQ(side(8, 1, false), 1);
  EXPECT_EQ(side(1, 8, false), -1);
  EXPECT_EQ(side(7, 1, false), 0);
  EXPECT_EQ(side(0, 0, false), 0);
  // More than a double's smallest power of 1/2: scipy.stats.binomtest(1446, 3000).pvalue is 0.0507, of 1445 it is
  // 0.0467.
  EXPECT_EQ(side(1500, 1500, false), 0);
  EXPECT_EQ(side(1554, 1446, false), 0);
  EXPECT_EQ(side(1555, 1445, false), 1);
}

TEST(ComparePairs, OfNothingSaysNothing) {
  for (const std::vector<Pair>& pairs : {std::vector<Pair>{}, {{"a", failed, failed}, {"b", failed, failed}}}) {
    const Comparison comparison = compare_pairs(pairs, false);
    EXPECT_EQ(comparison.compared(), 0u);
    EXPECT_EQ(comparison.runs.all(), pairs.size());
    EXPECT_EQ(comparison.test.p, 1);
    EXPECT_EQ(comparison.interval.lower, -infinite);
    EXPECT_FALSE(comparison.median_of_both);
    EXPECT_FALSE(difference_shown(comparison, 1));
  }
}

TEST(MedianOfDifferences, LiesBetweenTheMiddleTwo) {
  EXPECT_EQ(median_of_differences({1, 2, infinite}), 2);
  EXPECT_EQ(median_of_differences({1, 2, 4, infinite}), 3);
  EXPECT_EQ(median_of_differences({1, infinite}), infinite);
  EXPECT_EQ(median_of_differences({-infinite, 1}), -infinite);
  EXPECT_EQ(median_of_differences({infinite, infinite}), infinite);
  EXPECT_EQ(median_of_differences({-infinite, infinite}), 0) << "both failed equally often";
  EXPECT_EQ(MESSAGE_OF(median_of_differences({})), "there are no differences; give at least one");
}

TEST(FewestCases, GrowWithTheComparisons) {
  // 2^(1 - n): 1/32 for 6 cases; with ten comparisons, 10 / 128 = 0.078 for 8 and 10 / 256 = 0.039 for 9.
  EXPECT_EQ(fewest_cases(0.05), 6u);
  EXPECT_EQ(fewest_cases(0.01), 8u);
  EXPECT_EQ(fewest_cases(0.05, 10), 9u);
  EXPECT_EQ(fewest_cases(0.5), 3u) << "0.5 is not below 0.5";
  EXPECT_EQ(MESSAGE_OF(fewest_cases(5)), "alpha is 5; give a fraction between 0 and 1, such as 0.05");
  EXPECT_EQ(MESSAGE_OF(fewest_cases(0.05, 0)), "there are no comparisons; give at least one");
}

/// Values in tenths of a mm, exactly as they are meant, without rounding.
struct Tenths {
  std::vector<long> reference, variant;
};

Tenths drawn_tenths(std::uint64_t seed, std::size_t cases, long offset) {
  marrow::Random random(seed);
  Tenths values;
  for (std::size_t c = 0; c < cases; ++c) {
    values.reference.push_back(offset + 5 + long(random.index(6)));
    values.variant.push_back(values.reference.back() + long(random.index(6)) - 2);
  }
  return values;
}

/// p of the signed ranks by trying all signs, in whole numbers: Pratt's zeros, doubled mean ranks of ties.
double exact_p(const Tenths& values) {
  std::vector<long> differences;
  for (std::size_t c = 0; c < values.variant.size(); ++c)
    differences.push_back(values.variant[c] - values.reference[c]);
  std::vector<long> ranks;  // doubled, of those that are not 0
  long positive = 0, all = 0;
  for (const long one : differences) {
    if (!one) continue;
    long below = 0, equal = 0;
    for (const long other : differences) {
      below += std::labs(other) < std::labs(one);
      equal += std::labs(other) == std::labs(one);
    }
    ranks.push_back(2 * below + equal + 1);
    all += ranks.back();
    if (one > 0) positive += ranks.back();
  }
  const long smaller = std::min(positive, all - positive);
  long as_extreme = 0;
  for (std::size_t signs = 0; signs < (std::size_t(1) << ranks.size()); ++signs) {
    long sum = 0;
    for (std::size_t i = 0; i < ranks.size(); ++i)
      if (signs >> i & 1) sum += ranks[i];
    as_extreme += sum <= smaller;
  }
  return std::min(1.0, 2 * std::ldexp(double(as_extreme), -int(ranks.size())));
}

std::vector<Pair> pairs_of(const Tenths& values, double unit) {
  std::vector<Pair> pairs;
  for (std::size_t c = 0; c < values.variant.size(); ++c)
    pairs.push_back({std::to_string(c), double(values.reference[c]) * unit, double(values.variant[c]) * unit});
  return pairs;
}

TEST(RoundingNoise, DecidesNeitherTiesNorZeros) {
  // mm, um, cm, m, thirds and more of what is written in tenths of a mm; offsets that a double cannot hold exactly.
  const std::vector<double> units{0.1, 1, 100, 0.01, 1e-4, 0.1 / 3, 1e5, 0.1 * 25.4};
  for (std::uint64_t draw = 0; draw < 4000; ++draw) {
    const Tenths values = drawn_tenths(draw, 6 + draw % 6, draw % 3 == 0 ? 0 : draw % 3 == 1 ? 1001 : 1000007);
    const double expected = exact_p(values);
    for (const double unit : units) {
      const Comparison comparison = compare_pairs(pairs_of(values, unit), false);
      ASSERT_NEAR(comparison.test.p, expected, 1e-12) << "draw " << draw << ", unit " << unit;
      ASSERT_EQ(comparison.interval.lower > 0, compare_pairs(pairs_of(values, 1), false).interval.lower > 0);
    }
  }
}

TEST(RoundingNoise, IsZeroInMedianAndInterval) {
  // In doubles, neither 0.3 - 0.1 - 0.2 nor the mean of 0.1, 0.2 and -0.3 is exactly 0.
  std::vector<Pair> pairs;
  for (int c = 0; c < 8; ++c) pairs.push_back({std::to_string(c), 0.1 + 0.2, 0.3});
  for (const double difference : {0.1, 0.2, -0.3}) pairs.push_back({"mean", 1000.1, 1000.1 + difference});
  const Comparison comparison = compare_pairs(pairs, false);
  EXPECT_EQ(comparison.median_difference, 0);
  EXPECT_EQ(comparison.interval.lower, 0);
  EXPECT_EQ(comparison.interval.upper, 0);
  EXPECT_EQ(comparison.test.zeros, 9u);
  EXPECT_EQ(comparison.test.p, 1);
}

TEST(RoundingNoise, OfALargeValueTiesNoOthers) {
  // The case of 1e6 has a noise of 0.001, which is more than the other differences.
  const std::vector<Pair> pairs{{"a", 0.1, 0.1001}, {"b", 0.2, 0.2002}, {"c", 0.1, 0.0997}, {"far", 1e6, 1e6 + 0.5}};
  const SignedRank test = compare_pairs(pairs, false).test;
  EXPECT_EQ(test.zeros, 0u);
  EXPECT_EQ(test.negative_ranks, 3) << "0.0001, 0.0002 and 0.0003 keep their ranks";
  const std::vector<Pair> within{{"a", 0.1, 0.1001}, {"b", 0.2, 0.2002}, {"c", 0.1, 0.0997}, {"far", 1e6, 1e6 + 5e-4}};
  EXPECT_EQ(compare_pairs(within, false).test.zeros, 1u);
}

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

TEST(SignedRank, TiesKeepTheExactDistributionAndZerosAreLeftOut) {
  // Five equal differences: all ranks 3, so only the signs count: 2/32, where the approximation has 0.0369.
  EXPECT_DOUBLE_EQ(signed_rank_test({2, 2, 2, 2, 2}).p, 2.0 / 32);
  EXPECT_NEAR(signed_rank_test({2, 2, 2, 2, 2}, SignedRankMethod::normal).p, 0.0369, 1e-4);
  // Ranks 1.5 1.5 3 4, negative 1.5: sums up to 1.5 are {}, {first}, {second}: 2 * 3/16.
  EXPECT_DOUBLE_EQ(signed_rank_test({-1, 1, 2, 3}).p, 6.0 / 16);
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

TEST(SignedRank, ManyCasesUseTheApproximationAndNaNIsRefused) {
  std::vector<double> differences;
  for (int i = 1; i <= 51; ++i) differences.push_back(i % 3 ? i : -i);
  const SignedRank test = signed_rank_test(differences);
  // Multiples of 3 up to 51 add up to 459; mean 663, variance 51 * 52 * 103 / 24 = 11381.5: z = 203.5 / 106.684.
  EXPECT_FALSE(test.exact);
  EXPECT_EQ(test.negative_ranks, 459);
  EXPECT_NEAR(test.p, 0.05646, 1e-4);
  EXPECT_HAS(MESSAGE_OF(signed_rank_test(differences, SignedRankMethod::exact)), "at most 50");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_HAS(MESSAGE_OF(signed_rank_test({1, nan})), "difference 2 of 2 is nan");
  EXPECT_HAS(MESSAGE_OF(signed_rank_test({})), "no differences");
}

TEST(SignedRank, FailuresShareTheHighestRankAndTiesAreThoseUpToTheLastDigits) {
  // Ranks 1, 2 and, for the three failures, (3 + 4 + 5) / 3 = 4; negative 4: of 32 assignments, sums up to 4 are {},
  // {1}, {2}, {1, 2} and each of the three 4s: 2 * 7/32.
  const SignedRank test = signed_rank_test({1, 2, infinite, infinite, -infinite});
  EXPECT_EQ(test.negative_ranks, 4);
  EXPECT_EQ(test.positive_ranks, 11);
  EXPECT_DOUBLE_EQ(test.p, 14.0 / 32);
  EXPECT_DOUBLE_EQ(signed_rank_test({infinite, infinite, infinite, infinite, infinite, infinite}).p, 2.0 / 64);
  // 0.1 * 3 is 0.30000000000000004.
  EXPECT_EQ(signed_rank_test({0.1 * 3, -0.3, 1}).positive_ranks, 4.5);
  EXPECT_EQ(signed_rank_test({0.3 * (1 + 1e-8), -0.3, 1}).positive_ranks, 5) << "the two magnitudes are not tied";
  EXPECT_EQ(signed_rank_test({1e-7, -2e-7, 1e6}).positive_ranks, 4) << "an outlier does not tie the others";
}

}  // namespace paired_test
