// SPDX-License-Identifier: Apache-2.0
#include "marrow/shaft/widths.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::widths_test {

using shaft::Widths;

TEST(Widths, OfAFemurGoWithItsTaper) {
  const Widths femur({}, {}, 0);
  EXPECT_NEAR(femur.log_likelihood(28, 0), 0, 0.01);      // the middle
  EXPECT_NEAR(femur.log_likelihood(36.7, 8.9), 0, 0.01);  // a fifth of the length above the condyles, from the front
  EXPECT_LT(femur.log_likelihood(36.7, 0), -1);           // as wide, but a cylinder
  EXPECT_LT(femur.log_likelihood(28, 9), -1);             // as a cone is not in the middle
  EXPECT_LT(femur.log_likelihood(12, 0), -10);            // a canal
}

TEST(Widths, AreWithinThreeDeviationsAtSomeLevel) {
  const Widths femur({}, {}, 0);
  EXPECT_EQ(femur.range(), "18.0 to 48.7 mm");
  EXPECT_FALSE(femur.is_possible(17.9));
  EXPECT_TRUE(femur.is_possible(18.1));
  EXPECT_TRUE(femur.is_possible(48.6));
  EXPECT_FALSE(femur.is_possible(48.8));
  EXPECT_TRUE(Widths({}, {}, 0.05).is_possible(49.8));  // of a magnification known to 5 %
}

TEST(Widths, MayBeThoseOfAnotherBone) {
  const Widths tibia({25, 30}, {2, 3}, 0);
  EXPECT_NEAR(tibia.log_likelihood(25, 0), 0, 1e-9);
  EXPECT_NEAR(tibia.log_likelihood(33, 0), -0.5, 1e-9);
  EXPECT_EQ(tibia.range(), "19.0 to 39.0 mm");
  EXPECT_FALSE(tibia.is_possible(40));
  EXPECT_THROW(Widths({25, 30}, {2}, 0), std::out_of_range) << "nothing is read past the end of a list";
}

}  // namespace marrow::test::widths_test
