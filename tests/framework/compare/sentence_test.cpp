// SPDX-License-Identifier: Apache-2.0
#include <marrow/compare/paired.hpp>

#include "tests/harness/message_of.hpp"

namespace sentence_test {

using namespace marrow::compare;

Comparison comparison_of(double difference, double lower, double upper, std::size_t cases = 20) {
  Comparison comparison;
  comparison.cases.both = comparison.runs.both = cases;
  comparison.median_difference = difference;
  comparison.interval = {lower, upper, 0.95};
  comparison.test.positive_ranks = difference > 0 ? 200 : 10;
  comparison.test.negative_ranks = 210 - comparison.test.positive_ranks;
  return comparison;
}

constexpr double infinite = std::numeric_limits<double>::infinity();
const Metric target_error{"target error", "mm"};
const Metric unnamed{"", "mm"};

TEST(Sentence, SaysWhetherADifferenceIsShown) {
  EXPECT_EQ(sentence("canny", target_error, comparison_of(0.1234, 0.081, 0.1711), {1e-9}),
            "canny, target error: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases, p < 0.001");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.1234, 0.081, 0.1711), {0.0123}),
            "canny: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases, p = 0.012");
  EXPECT_EQ(
      sentence("canny", unnamed, comparison_of(0.0112, -0.031, 0.0521), {0.6213}),
      "canny: no difference shown: 0.01 mm worse, 95 % interval 0.03 mm better to 0.05 mm worse, 20 cases, p = 0.62");
}

TEST(Sentence, CountsInTheDirectionThatItNames) {
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(-0.1234, -0.1711, -0.081), {0.002}),
            "canny: 0.12 mm better, 95 % interval 0.08 to 0.17, 20 cases, p = 0.0020");
  EXPECT_EQ(
      sentence("canny", unnamed, comparison_of(-0.0112, -0.0521, 0.031), {0.6213}),
      "canny: no difference shown: 0.01 mm better, 95 % interval 0.03 mm worse to 0.05 mm better, 20 cases, p = 0.62");
  EXPECT_EQ(sentence("canny", {"overlap", "", true}, comparison_of(0.1234, 0.081, 0.1711), {0.002}),
            "canny, overlap: 0.12 better, 95 % interval 0.08 to 0.17, 20 cases, p = 0.0020");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0, -0.04, 0.05), {1}),
            "canny: no difference shown: 0.00 mm, 95 % interval 0.04 mm better to 0.05 mm worse, 20 cases, p = 1");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(-0.00001, -0.04, 0.05), {1}),
            "canny: no difference shown: 0.00 mm, 95 % interval 0.05 mm worse to 0.04 mm better, 20 cases, p = 1");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(2.0 / 9, 2.0 / 9 - 1e-16, 2.0 / 9 + 1e-16), {1e-9}),
            "canny: 0.22 mm worse, 95 % interval 0.22 to 0.22, 20 cases, p < 0.001");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0, 0, 0), {1}),
            "canny: no difference shown: 0 mm, 95 % interval 0 mm to 0 mm, 20 cases, p = 1");
}

TEST(Sentence, SaysThatTooFewCasesCannotShowAnything) {
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.1234, 0.081, 0.1711, 5), {0.0625}),
            "canny: no difference shown: 0.12 mm worse, 5 cases, p = 0.062; fewer than 6 cases cannot reach p < 0.05, "
            "and no interval is given");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(12.34, 12.34, 12.34, 1), {1}),
            "canny: no difference shown: 12 mm worse, 1 case, p = 1; fewer than 6 cases cannot reach p < 0.05, and no "
            "interval is given");
  // The least p of 8 cases is 2 / 256 = 0.0078, which Holm multiplies by up to 10; that of 9 cases is 0.0039.
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.9, 0.6, 1.1, 8), {0.078125, 10}),
            "canny: no difference shown: 0.9 mm worse, 95 % interval 0.6 to 1.1, 8 cases, p = 0.078; fewer than 9 "
            "cases cannot reach p < 0.05 with 10 comparisons");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.9, 0.6, 1.1, 5), {0.625, 10}),
            "canny: no difference shown: 0.90 mm worse, 5 cases, p = 0.62; fewer than 9 cases cannot reach p < 0.05 "
            "with 10 comparisons, and no interval is given");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.9, 0.6, 1.1, 9), {0.0390625, 10}),
            "canny: 0.9 mm worse, 95 % interval 0.6 to 1.1, 9 cases, p = 0.039");
}

TEST(Sentence, ShowsNothingWhereRanksAndMedianContradict) {
  Comparison comparison = comparison_of(-0.01, -0.0131, -0.0088, 200);
  comparison.test = {200, 0, 12840, 7260, 0.0007, false};
  EXPECT_FALSE(difference_shown(comparison, 0.0007));
  EXPECT_EQ(
      sentence("canny", unnamed, comparison, {0.0012}),
      "canny: no difference shown: 0.010 mm better, 95 % interval 0.009 to 0.013, 200 cases, p = 0.0012; the ranks and "
      "the median do not agree, look at the single cases");
  EXPECT_FALSE(difference_shown(comparison_of(0.1, 0, 0.2), 0.001));
  EXPECT_TRUE(difference_shown(comparison_of(0.1, 0.01, 0.2), 0.001));
  EXPECT_TRUE(difference_shown(comparison_of(-0.1, -0.2, -0.01), 0.001));
}

TEST(Sentence, SaysThatTheIntervalContainsZeroThoughPIsSmall) {
  EXPECT_EQ(
      sentence("canny", unnamed, comparison_of(0.1, -0.1, 0.3), {0.01}),
      "canny: no difference shown: 0.1 mm worse, 95 % interval 0.1 mm better to 0.3 mm worse, 20 cases, p = 0.010; "
      "the interval contains 0, look at the single cases");
}

/// `lost` cases in which only the variant failed, and `reference_lost` in which only the baseline did.
Comparison with_failures(Comparison comparison, std::size_t lost, std::size_t reference_lost, std::size_t neither) {
  comparison.cases = {comparison.cases.both - lost - reference_lost - neither, lost, reference_lost, neither};
  comparison.runs = comparison.cases;
  comparison.cases_of_both = comparison.cases.both;
  comparison.median_of_both = -0.2;
  return comparison;
}

TEST(Sentence, SaysWhoFailedAndOfHowManyCasesItIs) {
  EXPECT_EQ(
      sentence("canny", target_error, with_failures(comparison_of(0.1234, 0.081, infinite, 22), 3, 0, 2), {0.0031}),
      "canny, target error: 0.12 mm worse, 95 % interval 0.08 mm to a failure of canny, 20 of 22 cases, p = "
      "0.0031; of 22 runs, only canny failed in 3, only the baseline in 0, both in 2");
  EXPECT_EQ(sentence("canny", unnamed, with_failures(comparison_of(-0.1234, -infinite, -0.081, 20), 0, 6, 0), {0.0031}),
            "canny: 0.12 mm better, 95 % interval 0.08 mm to a failure of the baseline, 20 cases, p = 0.0031; of 20 "
            "runs, only canny failed in 0, only the baseline in 6, both in 0");
  EXPECT_EQ(sentence("canny", {"overlap", "", true},
                     with_failures(comparison_of(0.12, -infinite, infinite, 7), 1, 1, 0), {0.5}),
            "canny, overlap: no difference shown: 0.12 better, 95 % interval a failure of canny to a failure of the "
            "baseline, 7 cases, p = 0.50; of 7 runs, only canny failed in 1, only the baseline in 1, both in 0");
  EXPECT_EQ(sentence("canny", unnamed, with_failures(comparison_of(0.12, 0.12, 0.12, 2), 0, 0, 2), {1}),
            "canny: no case can be compared; of 2 runs, only canny failed in 0, only the baseline in 0, both in 2");
}

TEST(Sentence, SaysFirstWhoFailsMoreWhereTheMedianIsAFailure) {
  EXPECT_EQ(sentence("canny", target_error, with_failures(comparison_of(infinite, infinite, infinite, 30), 22, 0, 0),
                     {0.0001}),
            "canny, target error: fails more often than the baseline, in 22 of 30 cases, p < 0.001; of 30 runs, only "
            "canny failed in 22, only the baseline in 0, both in 0; where both have a value, in 8 cases, the median is "
            "0.20 mm better");
  EXPECT_EQ(sentence("canny", target_error, with_failures(comparison_of(-infinite, -infinite, -0.31, 31), 0, 22, 1),
                     {0.0001}),
            "canny, target error: the baseline fails more often, in 22 of 30 cases, 95 % interval 0.31 mm better to a "
            "failure of the baseline, 30 of 31 cases, p < 0.001; of 31 runs, only canny failed in 0, only "
            "the baseline in 22, both in 1; where both have a value, in 8 cases, the median is 0.20 mm better");
  EXPECT_EQ(
      sentence("canny", unnamed, with_failures(comparison_of(infinite, -0.2, infinite, 30), 20, 0, 0), {0.0001}),
      "canny: no difference shown: fails more often than the baseline, in 20 of 30 cases, 95 % interval 0.20 mm "
      "better to a failure of canny, p < 0.001; of 30 runs, only canny failed in 20, only the "
      "baseline in 0, both in 0; where both have a value, in 10 cases, the median is 0.20 mm better; the interval "
      "contains 0, look at the single cases");
}

TEST(Sentence, RoundsByTheWidthOfTheInterval) {
  const auto text = [](double difference, double lower, double upper) {
    const std::string whole = sentence("a", unnamed, comparison_of(difference, lower, upper), {0.01});
    return whole.substr(3, whole.find(", 20 cases") - 3);
  };
  EXPECT_EQ(text(1234.5, 1000.2, 1500.7), "1234 mm worse, 95 % interval 1000 to 1501");
  EXPECT_EQ(text(1.26, 1.11, 1.37), "1.26 mm worse, 95 % interval 1.11 to 1.37");
  EXPECT_EQ(text(2.26, 0.71, 4.76), "2.3 mm worse, 95 % interval 0.7 to 4.8");
  EXPECT_EQ(text(0.12, 0.12, 0.12), "0.12 mm worse, 95 % interval 0.12 to 0.12");
  EXPECT_EQ(text(0.0456, 0.0012, 0.0934), "0.046 mm worse, 95 % interval 0.001 to 0.093");  // not 0.00 to 0.09
  EXPECT_EQ(text(1.1e-6, 0.8e-6, 1.4e-6), "0.0000011 mm worse, 95 % interval 0.0000008 to 0.0000014");
}

TEST(Sentence, NeverRoundsPToZeroOrAcrossAlpha) {
  const auto p = [](double value, double alpha = 0.05) {
    const std::string text = sentence("a", unnamed, comparison_of(0.1, 0.05, 0.2), {value}, alpha);
    return text.substr(text.find("p "), text.find(';') - text.find("p "));
  };
  EXPECT_EQ(p(0), "p < 0.001");
  EXPECT_EQ(p(0.00099), "p < 0.001");
  EXPECT_EQ(p(0.001), "p = 0.0010");
  EXPECT_EQ(p(0.0123), "p = 0.012");
  EXPECT_EQ(p(0.04996), "p = 0.04996");
  EXPECT_EQ(p(0.0504), "p = 0.0504");
  EXPECT_EQ(p(0.05), "p = 0.050");
  EXPECT_EQ(p(0.997), "p = 1");
  EXPECT_EQ(p(0.0996, 0.1), "p = 0.0996");
}

TEST(Sentence, RefusesWhatIsNoProbability) {
  const Comparison comparison = comparison_of(0.1, 0.05, 0.2);
  EXPECT_HAS(MESSAGE_OF(sentence("a", unnamed, comparison, {1.5})), "p is 1.5");
  EXPECT_HAS(MESSAGE_OF(sentence("a", unnamed, comparison, {std::numeric_limits<double>::quiet_NaN()})), "p is nan");
  EXPECT_HAS(MESSAGE_OF(sentence("a", unnamed, comparison, {0.5}, 5)), "alpha is 5");
}

}  // namespace sentence_test
