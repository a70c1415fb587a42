// SPDX-License-Identifier: Apache-2.0
// All numbers are those of numpy.quantile (numpy 1.24, method "linear"). Larger samples are compared in
// tests/framework/compare/scipy_test.py.
#include <gtest/gtest.h>

#include "marrow/domain/quantile.hpp"

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
}

TEST(Quantile, OfEqualValuesIsTheirValue) {
  for (const double fraction : {0.0, 0.1, 1.0 / 3, 0.5, 0.95})
    EXPECT_EQ(quantile<double>({0.1, 0.1, 0.1}, fraction), 0.1);
}

}  // namespace quantile_test
