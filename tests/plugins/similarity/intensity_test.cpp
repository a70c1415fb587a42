// SPDX-License-Identifier: Apache-2.0
// The building blocks of the measures, on patches of a few pixels, compared with values computed by hand.
#include "marrow/similarity/intensity.hpp"
#include "marrow/similarity/patches.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::intensity_test {

using match::Gradients;
using match::Patch;

/// The mean correlation in squares of 4 x 4, or of 6 x 6.
double mean_patch_correlation(Patch patch, const std::vector<float>& a, const std::vector<float>& b, int side) {
  patch.rendered = a;
  patch.seen = b;
  match::BlockSums sums((match::Blocks()));
  match::Tally tally(patch, 1, sums);
  const auto measure = match::correlation_in_squares(side, [](const Patch& one) { return std::vector{one}; });
  measure.add(patch, tally);
  return 1 - measure.value(sums.all());
}

/// Five columns and four rows. The radiograph is 2 u + 3 v, the image 10 u - v; all pixels count.
Patch ramps() {
  Patch patch{5, 4, 0, 0, {}, {}, std::vector<char>(20, 1)};
  for (int v = 0; v < 4; ++v)
    for (int u = 0; u < 5; ++u) {
      patch.rendered.push_back(float(2 * u + 3 * v));
      patch.seen.push_back(float(10 * u - v));
    }
  return patch;
}

TEST(Gradients, OfARampAreItsSlopes) {
  const Patch patch = ramps();
  const Gradients gradients = match::gradients_of(patch);
  for (int v = 0; v < 4; ++v)
    for (int u = 0; u < 5; ++u) {
      const std::size_t i = patch.at(u, v);
      const bool is_inside = u > 0 && u < 4 && v > 0 && v < 3;
      EXPECT_EQ(gradients.u.counts[i], is_inside) << u << ' ' << v;
      // Half the difference between neighbours is the slope.
      EXPECT_EQ(gradients.u.rendered[i], is_inside ? 2 : 0) << u << ' ' << v;
      EXPECT_EQ(gradients.v.rendered[i], is_inside ? 3 : 0);
      EXPECT_EQ(gradients.u.seen[i], is_inside ? 10 : 0);
      EXPECT_EQ(gradients.v.seen[i], is_inside ? -1 : 0);
    }
  // (2 * 10 + 3 * -1) / (2^2 + 3^2) at each of the six pixels.
  EXPECT_NEAR(match::scale_of(gradients).value, 17.0 / 13.0, 1e-12);
}

TEST(Gradients, CountWhereAllNinePixelsDo) {
  for (int v = 0; v < 4; ++v)
    for (int u = 0; u < 5; ++u) {
      Patch patch = ramps();
      patch.counts[patch.at(u, v)] = 0;
      const Gradients gradients = match::gradients_of(patch);
      for (int row = 1; row < 3; ++row)
        for (int column = 1; column < 4; ++column)
          EXPECT_EQ(gradients.u.counts[patch.at(column, row)], std::abs(column - u) > 1 || std::abs(row - v) > 1)
              << "without pixel " << u << ' ' << v << ", at " << column << ' ' << row;
    }
}

TEST(Gradients, ScaleLeavesOutWhatDoesNotCount) {
  Patch patch = ramps();
  Gradients gradients = match::gradients_of(patch);
  gradients.u.seen[patch.at(1, 1)] = 1e6f;
  gradients.u.counts[patch.at(1, 1)] = 0;
  EXPECT_NEAR(match::scale_of(gradients).value, 17.0 / 13.0, 1e-12);
  gradients.u.counts.assign(20, 0);
  EXPECT_EQ(match::scale_of(gradients).value, 0);
}

TEST(Moments, OfTheValuesThatCount) {
  // 0 to 15, and a last pixel that does not count.
  std::vector<float> a, b, odd;
  for (int i = 0; i < 17; ++i) a.push_back(float(i)), b.push_back(float(100 - 3 * i)), odd.push_back(float(i % 2));
  std::vector<char> counts(17, 1);
  a[16] = b[16] = odd[16] = 1e6f;
  counts[16] = 0;
  EXPECT_NEAR(match::correlation(a, a, counts), 1, 1e-12);
  EXPECT_NEAR(match::correlation(a, b, counts), -1, 1e-12);
  // The covariance of i and i % 2 is 1/4; the variances are 255/12 and 1/4.
  EXPECT_NEAR(match::correlation(a, odd, counts), 0.25 / std::sqrt(255 / 12.0 * 0.25), 1e-12);
  EXPECT_EQ(match::correlation(a, std::vector<float>(17, 5), counts), 0);
  EXPECT_NEAR(match::deviation(a, counts), std::sqrt(255 / 12.0), 1e-12);
  EXPECT_NEAR(match::deviation(odd, counts), 0.5, 1e-12);
  counts[3] = 0;
  EXPECT_EQ(match::correlation(a, a, counts), 0) << "fewer than 16";
  EXPECT_EQ(match::deviation(a, counts), 0);
}

TEST(Patches, WeighEachSquareByItsVariance) {
  // Two squares of 4 x 4. In the left one the radiograph agrees with the image, in the right one it is opposite.
  Patch patch{8, 4, 0, 0, {}, {}, std::vector<char>(32, 1)};
  std::vector<float> a, b;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 8; ++column) {
      const float step = float((column + row) % 2);
      a.push_back(column < 4 ? 3 * step : step);
      b.push_back(column < 4 ? step : -step);
    }
  // Variances of the squares at columns 0, 2 and 4: 16 x 9/4, of both halves, and 16 x 1/4; the correlations of the
  // first and last are 1 and -1.
  const double middle_a = 8 * 9.0 + 8 * 1.0, mean_a = (4 * 3.0 + 4 * 1.0) / 16;
  const double variance_a = middle_a / 2 - 16 * mean_a * mean_a, variance_b = 8 - 0.0, covariance = 4 * 3.0 - 4 * 1.0;
  const double expected =
      (36 * 1 + variance_a * covariance / std::sqrt(variance_a * variance_b) + 4 * -1) / (36 + variance_a + 4);
  EXPECT_NEAR(mean_patch_correlation(patch, a, b, 4), expected, 1e-12);
}

TEST(Patches, LieWhereTheyLieInTheImage) {
  // The 6 columns begin at column 3 of the image. They contain only one whole square of 4 x 4, at column 4 of the
  // image.
  Patch patch{6, 4, 3, 0, {}, {}, std::vector<char>(24, 1)};
  std::vector<float> a(24), b(24);
  for (int i = 0; i < 24; ++i)
    a[std::size_t(i)] = float(i * i % 7), b[std::size_t(i)] = i % 6 == 0 || i % 6 == 5 ? 50.0f : float(i * i % 7);
  EXPECT_NEAR(mean_patch_correlation(patch, a, b, 4), 1, 1e-12);
}

TEST(Patches, AConstantRadiographSaysNothing) {
  const Patch patch{6, 6, 0, 0, {}, {}, std::vector<char>(36, 1)};
  std::vector<float> b;
  for (int i = 0; i < 36; ++i) b.push_back(float(i % 5));
  for (int i = 0; i < 100; ++i)  // whatever rounding leaves of it
    EXPECT_EQ(mean_patch_correlation(patch, std::vector<float>(36, 1000.1f + 77.7f * float(i)), b, 6), -1) << i;
}

}  // namespace marrow::test::intensity_test
