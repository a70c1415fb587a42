// SPDX-License-Identifier: Apache-2.0
// The building blocks of the measures, on patches of a few pixels, compared with values computed by hand.
#include <numeric>

#include "blob_scene.hpp"
#include "marrow/similarity/patches.hpp"

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

// The measures compared with the formulas that the papers print (Penney et al., IEEE Trans Med Imaging 1998), summed
// pixel by pixel over the whole image.
namespace marrow::test::formulas_test {

constexpr int kWidth = 200, kHeight = 170, kMargin_px = 400;  // so wide that the whole image is compared

/// Grey values of the image as line integrals, and the radiograph's, at every pixel.
struct Images {
  Numbers seen, rendered;
  double seen_at(int u, int v) const { return seen[std::size_t(v * kWidth + u)]; }
};

View seen_view() { return blob_scene::view_of(50000, 0.02, 60); }

Images images_at(double du, double dv) {
  Images images;
  const View view = seen_view();
  double brightest = 0;
  cv::minMaxLoc(view.image.pixels, nullptr, &brightest);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      images.seen.push_back(-std::log(view.image.pixels.at<std::uint16_t>(v, u) / brightest));
      images.rendered.push_back(blob_scene::blobs(u - du, v - dv));
    }
  return images;
}

double mean(const Numbers& x) { return std::accumulate(x.begin(), x.end(), 0.0) / double(x.size()); }
double covariance(const Numbers& x, const Numbers& y) {
  const double a = mean(x), b = mean(y);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - a) * (y[i] - b);
  return sum / double(x.size());
}
double correlation(const Numbers& x, const Numbers& y) {
  return covariance(x, y) / std::sqrt(covariance(x, x) * covariance(y, y));
}
/// Sobel's gradient divided by 8, where all nine pixels are in the image.
std::array<Numbers, 2> gradients(const Numbers& image) {
  std::array<Numbers, 2> g;
  const auto at = [&](int u, int v) { return image[std::size_t(v * kWidth + u)]; };
  for (int v = 1; v + 1 < kHeight; ++v)
    for (int u = 1; u + 1 < kWidth; ++u) {
      g[0].push_back((at(u + 1, v - 1) - at(u - 1, v - 1) + 2 * (at(u + 1, v) - at(u - 1, v)) + at(u + 1, v + 1) -
                      at(u - 1, v + 1)) /
                     8);
      g[1].push_back((at(u - 1, v + 1) - at(u - 1, v - 1) + 2 * (at(u, v + 1) - at(u, v - 1)) + at(u + 1, v + 1) -
                      at(u + 1, v - 1)) /
                     8);
    }
  return g;
}

/// seen - s * rendered, where least squares of the gradients give s. Without the model it is the image itself.
Numbers difference(const Images& images, bool with_model = true) {
  const auto seen = gradients(images.seen), rendered = gradients(images.rendered);
  double products = 0, squares = 0;
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < seen[k].size(); ++i)
      products += seen[k][i] * rendered[k][i], squares += rendered[k][i] * rendered[k][i];
  const double s = with_model ? products / squares : 0;
  Numbers d;
  for (std::size_t i = 0; i < images.seen.size(); ++i) d.push_back(images.seen[i] - s * images.rendered[i]);
  return d;
}

double entropy(const std::map<std::pair<int, int>, double>& histogram, double n) {
  double sum = 0;
  for (const auto& [bin, count] : histogram) sum -= count / n * std::log(count / n);
  return sum;
}
std::pair<double, double> range(const Numbers& x) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  return {*low, *high};
}

/// With pixels of the whole image, however far the model's region reaches.
double value(const std::string& measure, double du, double dv, const Options& more = {}) {
  const auto everywhere = [](const RigidTransform&) { return PixelGrid{0, 0, 1, kWidth, kHeight}; };
  return cost_by("similarity." + measure,
                 {{"projector", blob_scene::blob_projector(everywhere)}, {"views", each_view(seen_view())}},
                 with({{"sigma_steps", 0.0}, {"pixel_step", std::int64_t(1)}, {"margin_px", std::int64_t(kMargin_px)}},
                      more))
      ->value(blob_scene::at(du, dv));
}

/// Tells the value of a measure at each of three places, by `formula` of the images there.
void expect_formula(const std::string& measure, double tolerance, const std::function<double(const Images&)>& formula,
                    const Options& options = {}) {
  for (const auto& [du, dv] : std::vector<std::pair<double, double>>{{0, 0}, {2, -1}, {-5, 6}})
    EXPECT_NEAR(value(measure, du, dv, options), formula(images_at(du, dv)), tolerance) << du << ' ' << dv;
}

TEST(Formulas, NormalisedCrossCorrelation) {
  expect_formula("normalised_cross_correlation", 1e-5,
                 [](const Images& images) { return 1 - correlation(images.rendered, images.seen); });
}

TEST(Formulas, GradientCorrelation) {
  expect_formula("gradient_correlation", 1e-4, [](const Images& images) {
    const auto seen = gradients(images.seen), rendered = gradients(images.rendered);
    return 1 - 0.5 * (correlation(rendered[0], seen[0]) + correlation(rendered[1], seen[1]));
  });
}

/// The cubic B-spline about 0.
double b_spline(double x) {
  const double a = std::abs(x);
  return a < 1 ? 2.0 / 3 - a * a * (1 - a / 2) : a < 2 ? std::pow(2 - a, 3) / 6 : 0;
}

TEST(Formulas, MutualInformation) {
  constexpr int kBins = 32;
  // A value at a bin's border may fall into either.
  expect_formula("mutual_information", 1e-3, [](const Images& images) {
    const auto [b_low, b_high] = range(images.seen);
    const double most = range(images.rendered).second;
    double top = 1;  // the next number of four an octave that is not below the largest value
    while (top < most) top *= std::pow(2, 0.25);
    while (top * std::pow(2, -0.25) >= most) top *= std::pow(2, -0.25);
    std::map<std::pair<int, int>, double> of_a, of_b, joint;
    for (std::size_t i = 0; i < images.seen.size(); ++i) {
      const int b = std::min(kBins - 1, int(kBins * (images.seen[i] - b_low) / (b_high - b_low)));
      of_b[{0, b}] += 1;
      for (int a = 0; a < kBins; ++a) {
        const double weight = b_spline(images.rendered[i] / top * (kBins - 3) - a + 1);
        if (weight > 0) of_a[{a, 0}] += weight, joint[{a, b}] += weight;
      }
    }
    const double n = kWidth * kHeight;
    return 2 - (entropy(of_a, n) + entropy(of_b, n)) / entropy(joint, n);
  });
}

TEST(Formulas, EntropyOfDifference) {
  expect_formula("entropy_of_difference", 1e-3, [](const Images& images) {
    const auto [low, high] = range(images.seen);
    const auto entropy_of = [low = low, high = high](const Numbers& d) {
      std::map<std::pair<int, int>, double> histogram;
      for (const double x : d) histogram[{std::min(64, int(std::floor(0.5 + 64 * (x - low) / (high - low)))), 0}] += 1;
      return entropy(histogram, kWidth * kHeight);
    };
    return std::min(2.0, entropy_of(difference(images)) / entropy_of(difference(images, false)));
  });
}

TEST(Formulas, PatternIntensity) {
  const int r = 2;
  const double sigma = 0.3;
  const auto formula = [&](const Images& images) {
    const double s2 = sigma * sigma * covariance(images.seen, images.seen);
    // P = the sum over pixels and their neighbours of s^2 / (s^2 + d^2); its largest value is the number of pairs.
    const auto pattern = [&](const Numbers& d) {
      double sum = 0, pairs = 0;
      for (int v = 0; v < kHeight; ++v)
        for (int u = 0; u < kWidth; ++u)
          for (int y = -r; y <= r; ++y)
            for (int x = -r; x <= r; ++x) {
              if (x * x + y * y > r * r || (x == 0 && y == 0) || u + x < 0 || v + y < 0 || u + x >= kWidth ||
                  v + y >= kHeight)
                continue;
              const double step = d[std::size_t(v * kWidth + u)] - d[std::size_t((v + y) * kWidth + u + x)];
              sum += s2 / (s2 + step * step), pairs += 1;
            }
      return pairs - sum;
    };
    return std::min(2.0, pattern(difference(images)) / pattern(difference(images, false)));
  };
  expect_formula("pattern_intensity", 1e-4, formula, {{"radius_pixels", std::int64_t(r)}, {"sigma", sigma}});
}

TEST(Formulas, GradientDifference) {
  expect_formula("gradient_difference", 1e-4, [](const Images& images) {
    const auto seen = gradients(images.seen), left = gradients(difference(images));
    const auto missing = [&](const std::array<Numbers, 2>& g) {
      double sum = 0;
      for (std::size_t k = 0; k < 2; ++k) {
        const double variance = covariance(seen[k], seen[k]);
        for (const double d : g[k]) sum += 1 - variance / (variance + d * d);
      }
      return sum;
    };
    return std::min(2.0, missing(left) / missing(seen));
  });
}

TEST(Formulas, WhatTheModelDoesNotReachCountsAsWell) {
  // The value is the same whether the whole image is compared or only the model's surroundings, because the sums are
  // over a fixed region.
  for (const std::string measure : {"pattern_intensity", "gradient_difference", "entropy_of_difference"}) {
    const auto near = [&](double du, double dv) {
      return cost_by("similarity." + measure, blob_scene::inputs(blob_scene::view_of(50000, 0.02, 0)),
                     {{"pixel_step", std::int64_t(1)}, {"sigma_steps", 0.0}, {"margin_px", std::int64_t(16)}})
          ->value(blob_scene::at(du, dv));
    };
    EXPECT_LT(near(0, 0), 0.35) << measure << ": next to nothing is left";
    EXPECT_GT(near(60, 40), 0.95) << measure << ": where the image is even, the model explains nothing";
  }
}

}  // namespace marrow::test::formulas_test
