// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/random.hpp"

#include <gtest/gtest.h>

namespace random_test {

using marrow::Random;

// The first numbers of SplitMix64 from seed 0, as other implementations give them.
TEST(Random, IsSplitMix64) {
  Random random(0);
  EXPECT_EQ(random(), 0xe220a8397b1dcdafu);
  EXPECT_EQ(random(), 0x6e789e6aa1b965f4u);
  EXPECT_EQ(random(), 0x06c45d188009454fu);
}

TEST(Random, StreamsOfOneSeedDiffer) {
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

}  // namespace random_test
