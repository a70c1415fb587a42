// SPDX-License-Identifier: Apache-2.0
// The measures compared with the formulas that the papers print (Penney et al., IEEE Trans Med Imaging 1998), summed
// pixel by pixel over the whole image.
#include <numeric>

#include "blob_scene.hpp"

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
