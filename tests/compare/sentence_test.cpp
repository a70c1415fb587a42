// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <marrow/compare/statistics.hpp>

#include "domain/message_of.hpp"

namespace sentence_test {

using namespace marrow::compare;
using marrow::test::message_of;

Comparison comparison_of(double difference, double lower, double upper, std::size_t cases = 20) {
  Comparison comparison;
  comparison.cases = cases;
  comparison.median_difference = difference;
  comparison.interval = {lower, upper, 0.95};
  comparison.test.positive_ranks = difference > 0 ? 200 : 10;
  comparison.test.negative_ranks = 210 - comparison.test.positive_ranks;
  return comparison;
}

const Metric target_error{"target error", "mm"};
const Metric unnamed{"", "mm"};

TEST(Sentence, NamesADifference) {
  EXPECT_EQ(sentence("canny", target_error, comparison_of(0.1234, 0.081, 0.1711), 1e-9),
            "canny, target error: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases, p < 0.001");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.1234, 0.081, 0.1711), 0.0123),
            "canny: 0.12 mm worse, 95 % interval 0.08 to 0.17, 20 cases, p = 0.012");
}

TEST(Sentence, SaysWhereNoneIsShown) {
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.0112, -0.031, 0.0521), 0.6213),
            "canny: no difference shown: 0.01 mm worse, 95 % interval -0.03 to 0.05, 20 cases, p = 0.62");
}

TEST(Sentence, CountsInTheDirectionThatItNames) {
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(-0.1234, -0.1711, -0.081), 0.002),
            "canny: 0.12 mm better, 95 % interval 0.08 to 0.17, 20 cases, p = 0.0020");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(-0.0112, -0.0521, 0.031), 0.6213),
            "canny: no difference shown: 0.01 mm better, 95 % interval -0.03 to 0.05, 20 cases, p = 0.62");
  EXPECT_EQ(sentence("canny", {"overlap", "", true}, comparison_of(0.1234, 0.081, 0.1711), 0.002),
            "canny, overlap: 0.12 better, 95 % interval 0.08 to 0.17, 20 cases, p = 0.0020");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0, -0.04, 0.05), 1),
            "canny: no difference shown: 0.00 mm, 95 % interval -0.04 to 0.05 (positive is worse), 20 cases, p = 1");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(-0.00001, -0.04, 0.05), 1),
            "canny: no difference shown: 0.00 mm, 95 % interval -0.05 to 0.04 (positive is better), 20 cases, p = 1");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(2.0 / 9, 2.0 / 9 - 1e-16, 2.0 / 9 + 1e-16), 1e-9),
            "canny: 0.22 mm worse, 95 % interval 0.22 to 0.22, 20 cases, p < 0.001");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0, 0, 0), 1),
            "canny: no difference shown: 0 mm, 95 % interval 0 to 0 (positive is worse), 20 cases, p = 1");
}

TEST(Sentence, SaysThatTooFewCasesCannotShowAnything) {
  EXPECT_EQ(fewest_cases(0.05), 6u);
  EXPECT_EQ(fewest_cases(0.01), 8u);
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(0.1234, 0.081, 0.1711, 5), 0.0625),
            "canny: no difference shown: 0.12 mm worse, 5 cases, p = 0.062; fewer than 6 cases cannot reach p < 0.05, "
            "and no interval is given");
  EXPECT_EQ(sentence("canny", unnamed, comparison_of(12.34, 12.34, 12.34, 1), 1),
            "canny: no difference shown: 12 mm worse, 1 case, p = 1; fewer than 6 cases cannot reach p < 0.05, and no "
            "interval is given");
}

TEST(Sentence, ShowsNothingWhereRanksAndMedianContradict) {
  Comparison comparison = comparison_of(-0.01, -0.0131, -0.0088, 200);
  comparison.test = {200, 0, 12840, 7260, 0.0007, false};
  EXPECT_FALSE(difference_shown(comparison, 0.0007));
  EXPECT_EQ(
      sentence("canny", unnamed, comparison, 0.0012),
      "canny: no difference shown: 0.010 mm better, 95 % interval 0.009 to 0.013, 200 cases, p = 0.0012; the ranks and "
      "the median do not agree, look at the single cases");
  EXPECT_FALSE(difference_shown(comparison_of(0.1, 0, 0.2), 0.001));
  EXPECT_TRUE(difference_shown(comparison_of(0.1, 0.01, 0.2), 0.001));
  EXPECT_TRUE(difference_shown(comparison_of(-0.1, -0.2, -0.01), 0.001));
}

TEST(Sentence, RoundsByTheWidthOfTheInterval) {
  const auto text = [](double difference, double lower, double upper) {
    const std::string whole = sentence("a", unnamed, comparison_of(difference, lower, upper), 0.01);
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
    const std::string text = sentence("a", unnamed, comparison_of(0.1, 0.05, 0.2), value, alpha);
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
  EXPECT_NE(message_of([&] { sentence("a", unnamed, comparison, 1.5); }).find("p is 1.5"), std::string::npos);
  EXPECT_NE(message_of([&] {
              sentence("a", unnamed, comparison, std::numeric_limits<double>::quiet_NaN());
            }).find("p is nan"),
            std::string::npos);
  EXPECT_NE(message_of([&] { sentence("a", unnamed, comparison, 0.5, 5); }).find("alpha is 5"), std::string::npos);
}

}  // namespace sentence_test
