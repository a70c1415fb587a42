// SPDX-License-Identifier: Apache-2.0
// Curves over time by hand-computed values, and what they refuse. tests/tools/marrow/curves_numbers_test.py compares
// all figures with those of numpy and scipy.

#include <cmath>
#include <marrow/compare/curve_difference.hpp>

#include "tests/harness/message_of.hpp"

namespace curves_test {

using namespace marrow::compare;

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

TEST(PairedCurves, ValuesBetweenTwoFramesComeFromALineButNotFromAcrossAGap) {
  const Curve slow{{0.5, 1.5, 2.5, 3.5, 4.5}, {0, 0, 0, 0, 0}};
  const Curve fast{{0, 0.8, 1.6, 2.4, 3.2, 5.6}, {0, 8, 16, kGap, 32, 56}};  // 2.4 has no value; 4 and 4.8 are missing
  const PairedCurves pair = pair_curves(slow, fast);
  EXPECT_EQ(pair.at, slow.at);
  EXPECT_EQ(pair.interpolated, PairedCurves::Interpolated::second);
  EXPECT_NEAR(pair.second[0], 5, 1e-12);
  EXPECT_NEAR(pair.second[1], 15, 1e-12);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_TRUE(std::isnan(pair.difference[i])) << i;
}

TEST(PairedCurves, FramesThatOnlyOneHasStay) {
  const PairedCurves pair = pair_curves({{1, 2, 3}, {1, 1, 1}}, {{2, 3, 4, 6}, {2, 3, 4, 6}});
  EXPECT_EQ(pair.at, (std::vector<double>{1, 2, 3, 4, 6}));
  EXPECT_EQ(pair.interpolated, PairedCurves::Interpolated::none);
  const CurveDifference difference = difference_of(pair);
  EXPECT_EQ(difference.both, 2u);
  EXPECT_EQ(difference.only_first, 1u);
  EXPECT_EQ(difference.only_second, 2u);
  EXPECT_DOUBLE_EQ(difference.bias, 1.5);
  EXPECT_DOUBLE_EQ(difference.rms, std::sqrt(2.5));
  EXPECT_DOUBLE_EQ(difference.largest, 2);
  EXPECT_DOUBLE_EQ(difference.largest_at, 3);
  EXPECT_DOUBLE_EQ(*difference.deviation, std::sqrt(0.5));
  EXPECT_FALSE(difference.mean);
  EXPECT_FALSE(difference.lag);
}

TEST(PairedCurves, RefuseWhatCannotBePaired) {
  EXPECT_EQ(MESSAGE_OF(pair_curves({{1, 2}, {1}}, {{1, 2}, {1, 2}})), "the first curve has 2 times and 1 values");
  EXPECT_EQ(MESSAGE_OF(pair_curves({{1, 2}, {1, 2}}, {{1, 1}, {1, 2}})),
            "the times of the second sequence do not rise: 1 comes after 1");
}

TEST(MeanOfFrames, RefusesAGap) {
  std::vector<double> values(20, 1);
  values[3] = kGap;
  EXPECT_NE(MESSAGE_OF(mean_of_frames(values)), "");
}

TEST(CurveBand, IsAsWideAsTheTrialsScatterAndTheSimultaneousOneIsWider) {
  std::vector<std::vector<double>> trials;
  for (const double value : {-5, -3, -1, 1, 3, 5}) trials.push_back({value, 2 * value, 0.5, kGap});
  const CurveBand band = mean_band(trials);
  EXPECT_NEAR(band.mean[0], 0, 1e-12);
  EXPECT_NEAR(band.pointwise[0], 2.570581835636314 * std::sqrt(70.0 / 5 / 6), 1e-9);
  EXPECT_NEAR(band.simultaneous[1], 2 * band.simultaneous[0], 1e-9);
  EXPECT_GE(band.simultaneous[0], band.pointwise[0]);
  EXPECT_EQ(band.simultaneous[2], 0);
  EXPECT_TRUE(std::isnan(band.mean[3]) && std::isnan(band.simultaneous[3]));
  EXPECT_EQ(mean_band(trials).simultaneous[0], band.simultaneous[0]);
}

TEST(CurveBand, RefusesTooFewTrialsAndUnlikeOnes) {
  EXPECT_EQ(MESSAGE_OF(mean_band(std::vector<std::vector<double>>(5, {1, 2}))),
            "a band over trials needs at least 6, got 5");
  std::vector<std::vector<double>> trials(6, {1, 2});
  trials[4] = {1};
  EXPECT_EQ(MESSAGE_OF(mean_band(trials)), "the trials have curves of unlike length: 2 and 1 times");
}

}  // namespace curves_test
