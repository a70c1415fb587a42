// SPDX-License-Identifier: Apache-2.0
// All numbers are those of numpy.quantile (numpy 1.24, method "linear"). Larger samples are compared in
// tests/framework/compare/scipy_test.py.
#include <gtest/gtest.h>

#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"

namespace quantile_test {

using marrow::quantile;

TEST(Quantile, IsThatOfNumpy) {
  const std::vector<double> one{3}, two{1, 3}, five{4, -2, 0.5, 9.25, -7};
  const std::array<double, 6> fractions{0, 0.1, 0.5, 0.84, 0.95, 1};
  const std::array<double, 6> of_two{1, 1.2, 2, 2.68, 2.9, 3}, of_five{-7, -5, 0.5, 5.89, 8.2, 9.25};
  for (std::size_t i = 0; i < fractions.size(); ++i) {
    EXPECT_EQ(quantile(one, fractions[i]), 3);
    EXPECT_NEAR(quantile(two, fractions[i]), of_two[i], 1e-14) << fractions[i];
    EXPECT_NEAR(quantile(five, fractions[i]), of_five[i], 1e-14) << fractions[i];
  }
}

TEST(Quantile, IsTheSameHoweverItIsFound) {
  std::vector<float> values;
  for (int i = 0; i < 1000; ++i) values.push_back(float(i * 7919 % 1000) * 0.37f - 100);
  std::vector<float> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  for (const double fraction : {0.0, 0.005, 0.25, 0.3, 0.5, 0.9, 0.9995, 1.0}) {
    const double expected = marrow::quantile_of_sorted(sorted, fraction);
    std::vector<float> changed = values;
    EXPECT_EQ(quantile(values, fraction), expected) << fraction;
    EXPECT_EQ(marrow::quantile_in_place(changed, fraction), expected) << fraction;
  }
  for (const double fraction : {0.0, 0.1, 1.0 / 3, 0.5, 0.95})
    EXPECT_EQ(quantile<double>({0.1, 0.1, 0.1}, fraction), 0.1);
}

using marrow::Random;

// The first numbers of SplitMix64 from seed 0, as other implementations give them.
TEST(Random, IsSplitMix64AndStreamsOfOneSeedDiffer) {
  Random random(0);
  EXPECT_EQ(random(), 0xe220a8397b1dcdafu);
  EXPECT_EQ(random(), 0x6e789e6aa1b965f4u);
  EXPECT_EQ(random(), 0x06c45d188009454fu);
  EXPECT_EQ(Random(1, 2)(), Random(1, 2)());
  EXPECT_NE(Random(1, 2)(), Random(1, 3)());
  EXPECT_NE(Random(1, 2)(), Random(2, 2)());
}

TEST(Random, Distributions) {
  constexpr int kCount = 200000;
  Random random(7);
  double mean = 0, squares = 0, least = 1, most = 0;
  int count_of[3] = {};
  for (int i = 0; i < kCount; ++i) {
    const double uniform = random.uniform(), normal = random.normal();
    least = std::min(least, uniform);
    most = std::max(most, uniform);
    mean += normal / kCount;
    squares += normal * normal / kCount;
    ++count_of[random.index(3)];
  }
  EXPECT_GE(least, 0);
  EXPECT_LT(most, 1);
  EXPECT_LT(least, 1e-4);
  EXPECT_GT(most, 1 - 1e-4);
  // Five standard deviations of the mean, of the variance and of a count.
  EXPECT_NEAR(mean, 0, 5 / std::sqrt(double(kCount)));
  EXPECT_NEAR(squares, 1, 5 * std::sqrt(2.0 / kCount));
  for (const int count : count_of) EXPECT_NEAR(count, kCount / 3.0, 5 * std::sqrt(kCount * 2.0 / 9));
}

}  // namespace quantile_test
