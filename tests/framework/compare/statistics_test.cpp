// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <marrow/compare/paired.hpp>
#include <marrow/domain/random.hpp>

#include "tests/harness/message_of.hpp"

namespace statistics_test {

using namespace marrow::compare;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

TEST(Wilson, IsTheClosedFormAndEndsAtZeroAndOne) {
  // z = 1.959964; 8 of 10: centre (0.8 + 0.192073) / 1.384146, half-width 0.226582.
  const Interval interval = wilson_interval(8, 10);
  EXPECT_NEAR(interval.lower, 0.490162, 1e-6);
  EXPECT_NEAR(interval.upper, 0.943318, 1e-6);
  // The other bound of 0 of n is z^2 / (n + z^2).
  const Interval none = wilson_interval(0, 10);
  EXPECT_EQ(none.lower, 0);
  EXPECT_NEAR(none.upper, 3.841459 / 13.841459, 1e-6);
  const Interval all = wilson_interval(10, 10);
  EXPECT_EQ(all.upper, 1);
  EXPECT_NEAR(all.lower, 10 / 13.841459, 1e-6);
  EXPECT_HAS(MESSAGE_OF(wilson_interval(0, 0)), "at least one trial");
  EXPECT_HAS(MESSAGE_OF(wilson_interval(3, 2)), "3 successes of 2 trials");
  EXPECT_HAS(MESSAGE_OF(wilson_interval(1, 2, 95)), "0.95");
  EXPECT_HAS(MESSAGE_OF(wilson_interval(1, 2, nan)), "confidence");
}

/// Adds `runs` runs from a start with this error; the first `successes` of them succeed.
void add(std::vector<StartOutcome>& outcomes, double error, std::size_t successes, std::size_t runs) {
  for (std::size_t i = 0; i < runs; ++i) outcomes.push_back({error, i < successes});
}

TEST(CaptureRange, EndsBeforeTheFirstBinThatFails) {
  std::vector<StartOutcome> outcomes;
  add(outcomes, 7.9, 20, 20);  // beyond the failing bin: does not count
  add(outcomes, 0, 3, 3);
  add(outcomes, 2, 19, 20);  // just 95 %
  add(outcomes, 4, 8, 10);
  const CaptureRange capture = capture_range(outcomes);
  EXPECT_EQ(capture.range, 4);
  EXPECT_FALSE(capture.is_open);
  ASSERT_EQ(capture.bins.size(), 4u);
  EXPECT_EQ(capture.bins[2].from, 4);
  EXPECT_EQ(capture.bins[2].to, 6);
  EXPECT_EQ(capture.bins[2].successes, 8u);
  EXPECT_EQ(capture.bins[2].runs, 10u);
  EXPECT_NEAR(capture.bins[2].success.lower, 0.490162, 1e-6) << "as Wilson's interval of 8 of 10 above";
  EXPECT_NEAR(capture.bins[2].success.upper, 0.943318, 1e-6);
}

TEST(CaptureRange, CountsACaseOnceWhereItsStartsEndAlike) {
  std::vector<StartOutcome> outcomes;
  for (int i = 0; i < 100; ++i) outcomes.push_back({1, i >= 20, "case " + std::to_string(i / 10)});
  const CaptureRange capture = capture_range(outcomes);
  EXPECT_EQ(capture.bins[0].successes, 80u);
  EXPECT_EQ(capture.bins[0].runs, 100u);
  EXPECT_NEAR(capture.bins[0].success.lower, 0.490162, 1e-6) << "as Wilson's interval of 8 of 10 above";
  EXPECT_NEAR(capture.bins[0].success.upper, 0.943318, 1e-6);
}

TEST(CaptureRange, IsOpenWhereNoStartIsTooFar) {
  std::vector<StartOutcome> outcomes;
  add(outcomes, 1.5, 10, 10);
  add(outcomes, 7.25, 10, 10);
  const CaptureRange capture = capture_range(outcomes);
  EXPECT_EQ(capture.range, 7.25);
  EXPECT_TRUE(capture.is_open);
  EXPECT_EQ(capture.bins[1].runs, 0u);
  EXPECT_EQ(capture.bins[1].success.lower, 0) << "nothing is known of an empty bin";
  EXPECT_EQ(capture.bins[1].success.upper, 1);
}

TEST(CaptureRange, PassesOverEmptyBinsButReachesNoFurtherByThem) {
  std::vector<StartOutcome> outcomes;
  add(outcomes, 3, 10, 10);
  add(outcomes, 11, 1, 10);
  EXPECT_EQ(capture_range(outcomes).range, 4) << "4 to 10 mm were not tried";
  EXPECT_EQ(capture_range({{9, false}}).range, 0) << "0 to 8 mm were not tried";
  EXPECT_FALSE(capture_range({{9, false}}).is_open);
  EXPECT_EQ(capture_range({{0.3, true}, {0.4, true}}, 0.1).range, 0.4) << "the range ends at the farthest start";
  EXPECT_EQ(capture_range({}).range, 0);
  EXPECT_FALSE(capture_range({}).is_open);
}

TEST(CaptureRange, LostStartsShareTheLastBinAndOfOtherBinsAndRefusals) {
  const CaptureRange capture = capture_range({{1, true}, {250, false}, {1e9, false}});
  EXPECT_EQ(capture.range, 2);
  ASSERT_EQ(capture.bins.size(), 100u);
  EXPECT_EQ(capture.bins.back().from, 198);
  EXPECT_EQ(capture.bins.back().to, 1e9);
  EXPECT_EQ(capture.bins.back().runs, 2u);
  std::vector<StartOutcome> outcomes;
  add(outcomes, 0.5, 9, 10);
  add(outcomes, 1.5, 8, 10);
  EXPECT_EQ(capture_range(outcomes, 1, 0.9).range, 1);
  EXPECT_EQ(capture_range(outcomes, 2, 0.85).range, 1.5);
  EXPECT_EQ(MESSAGE_OF(capture_range({{nan, true}})),
            "the error of a start is nan, which is no distance; leave runs out whose start is not known");
  EXPECT_EQ(MESSAGE_OF(capture_range({{-1, true}})),
            "the error of a start is -1.000000, which is no distance; leave runs out whose start is not known");
  EXPECT_EQ(MESSAGE_OF(capture_range({}, 0)), "the width of a bin is 0.000000; give a positive one");
  EXPECT_EQ(MESSAGE_OF(capture_range({}, 2, 95)),
            "the success rate is 95.000000; give a fraction from 0 to 1, such as 0.95");
}

TEST(Summarise, InterpolatesBetweenSortedValues) {
  const Summary summary = summarise({4, 1, 3, 10});  // positions 0.75, 1.5, 2.25 and 2.85 in 1 3 4 10
  EXPECT_EQ(summary.count, 4u);
  EXPECT_DOUBLE_EQ(summary.mean, 4.5);
  EXPECT_DOUBLE_EQ(summary.lower_quartile, 2.5);
  EXPECT_DOUBLE_EQ(summary.median, 3.5);
  EXPECT_DOUBLE_EQ(summary.upper_quartile, 5.5);
  EXPECT_DOUBLE_EQ(summary.percentile_95, 9.1);
  EXPECT_DOUBLE_EQ(summary.worst, 10);
}

TEST(Summarise, OfOneValueIsThatValue) {
  const Summary summary = summarise({-2});
  for (double value : {summary.mean, summary.median, summary.lower_quartile, summary.upper_quartile,
                       summary.percentile_95, summary.worst})
    EXPECT_EQ(value, -2);
}

TEST(Summarise, OfAScoreTheLowestAreTheWorst) {
  const Summary summary = summarise({4, 1, 3, 10}, true);
  EXPECT_DOUBLE_EQ(summary.percentile_95, 1.3);  // position 0.15 in 1 3 4 10
  EXPECT_DOUBLE_EQ(summary.worst, 1);
  EXPECT_DOUBLE_EQ(summary.upper_quartile, 5.5);
}

TEST(Summarise, RefusesWhatIsNotFinite) {
  EXPECT_HAS(MESSAGE_OF(summarise({1, nan, 3})), "value 2 of 3 is nan");
  EXPECT_HAS(MESSAGE_OF(summarise({infinite})), "value 1 of 1 is inf");
  EXPECT_HAS(MESSAGE_OF(summarise({})), "no values");
}

TEST(Holm, StepsDownAndKeepsTheOrder) {
  const std::vector<double> corrected = holm({0.01, 0.04, 0.03, 0.005});
  ASSERT_EQ(corrected.size(), 4u);
  EXPECT_DOUBLE_EQ(corrected[0], 0.03);
  EXPECT_DOUBLE_EQ(corrected[1], 0.06);
  EXPECT_DOUBLE_EQ(corrected[2], 0.06);
  EXPECT_DOUBLE_EQ(corrected[3], 0.02);
  EXPECT_EQ(holm({0.7, 0.9}), (std::vector<double>{1, 1}));
  EXPECT_TRUE(holm({}).empty());
  EXPECT_HAS(MESSAGE_OF(holm({0.5, nan})), "p-value 2 of 2 is nan");
  EXPECT_HAS(MESSAGE_OF(holm({-0.1})), "from 0 to 1");
}

using marrow::compare::letters_of_groups;
using Letters = std::vector<std::string>;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(Letters, AreSharedByThoseThatNothingTellsApart) {
  EXPECT_EQ(letters_of_groups(0, {}), Letters());
  EXPECT_EQ(letters_of_groups(3, {}), (Letters{"a", "a", "a"}));
  EXPECT_EQ(letters_of_groups(2, {{1, 0}}), (Letters{"a", "b"}));
  EXPECT_EQ(letters_of_groups(3, {{0, 2}}), (Letters{"a", "ab", "b"}));
  const Pairs different{{0, 2}, {0, 3}, {0, 4}, {1, 3}, {1, 4}, {2, 4}};
  EXPECT_EQ(letters_of_groups(5, different), (Letters{"a", "ab", "bc", "cd", "d"}));
}

TEST(Letters, SayOfEachPairWhetherItDiffers) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    marrow::Random random(seed);
    const std::size_t things = 2 + random.index(6);
    Pairs different;
    for (std::size_t i = 0; i < things; ++i)
      for (std::size_t j = i + 1; j < things; ++j)
        if (random.uniform() < 0.4) different.emplace_back(i, j);
    const auto letters = letters_of_groups(things, different);
    ASSERT_TRUE(letters);
    for (std::size_t i = 0; i < things; ++i)
      for (std::size_t j = i + 1; j < things; ++j) {
        const bool differ = std::find(different.begin(), different.end(), std::pair(i, j)) != different.end();
        EXPECT_EQ((*letters)[i].find_first_of((*letters)[j]) == std::string::npos, differ) << seed;
      }
  }
}

TEST(Letters, AreNotGivenForTooFewLettersOrNoPair) {
  Pairs pairs;  // each with its neighbour alone: every choice of one of each pair is a group
  for (std::size_t i = 0; i < 4; ++i) pairs.emplace_back(2 * i, 2 * i + 1);
  EXPECT_EQ(letters_of_groups(8, pairs)->front(), "abcdefgh");
  pairs.emplace_back(8, 9);
  EXPECT_EQ(letters_of_groups(10, pairs), std::nullopt);  // 32 groups
  for (std::size_t i = 5; i < 40; ++i) pairs.emplace_back(2 * i, 2 * i + 1);
  EXPECT_EQ(letters_of_groups(80, pairs), std::nullopt);
  for (const auto& [one, other] : Pairs{{0, 3}, {3, 1}, {1, 1}})
    EXPECT_EQ(MESSAGE_OF(letters_of_groups(3, {{one, other}})),
              "the pair " + std::to_string(one) + " and " + std::to_string(other) +
                  " of 3 things cannot differ; give two of them, counted from 0");
}

TEST(NeededCases, ProbabilitiesAsByScipy) {
  EXPECT_DOUBLE_EQ(*spread_of_differences({1, 2, 3, 4, infinite}), std::sqrt(5.0 / 3));
  EXPECT_EQ(spread_of_differences({1, 2, infinite}), std::nullopt);
  EXPECT_EQ(*spread_of_differences({2, 2, 2}), 0);
  // Of 1000 experiments by numpy's random numbers and scipy.stats.wilcoxon; two such shares differ by less than 0.06
  // (3.2 deviations).
  EXPECT_NEAR(probability_to_show(0.3, 1, 142), 0.756, 0.06);
  EXPECT_NEAR(probability_to_show(0.5, 1, 54), 0.796, 0.06);
  EXPECT_NEAR(probability_to_show(-1, 2, 54), 0.796, 0.06);  // to the other side, in another unit
  EXPECT_NEAR(probability_to_show(1, 1, 17), 0.866, 0.06);
  EXPECT_NEAR(probability_to_show(0.5, 1, 60, 6), 0.769, 0.06);
  EXPECT_NEAR(probability_to_show(1, 1, 23, 6), 0.925, 0.06);
  EXPECT_NEAR(probability_to_show(0.5, 1, 74, 20), 0.827, 0.06);
  // Eight cases show a difference only if all agree: the interval goes from the smallest to the largest. By scipy:
  // norm.cdf(d)**8, and norm.ppf(0.8**(1/8)) = 1.918.
  EXPECT_NEAR(probability_to_show(1, 1, 8), 0.2510, 0.045);
  EXPECT_NEAR(probability_to_show(2, 1, 8), 0.8318, 0.04);
  EXPECT_NEAR(*difference_to_show(1, 8), 1.918, 0.12);
  EXPECT_NEAR(*difference_to_show(0.1, 8), 0.1918, 0.012);
}

TEST(NeededCases, AndDifferencesBelongTogetherOrAreNone) {
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
  EXPECT_EQ(MESSAGE_OF(probability_to_show(1, -1, 20)),
            "a difference of 1 with a spread of -1; expected two numbers, and a spread of 0 or more");
  EXPECT_EQ(MESSAGE_OF(cases_to_show(1, 1, 1, 1)),
            "the probability is 1; give a fraction between 0 and 1, such as 0.8");
  EXPECT_EQ(MESSAGE_OF(cases_to_show(1, 1, 0)), "there are no comparisons; give at least one");
}

}  // namespace statistics_test
