// SPDX-License-Identifier: Apache-2.0
// The measures compared with the formulas that the papers print (Penney et al., IEEE Trans Med Imaging 1998), summed
// pixel by pixel over the whole image.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "blob_scene.hpp"
#include "shipped.hpp"

namespace formulas_test {

constexpr int kWidth = 200, kHeight = 170, kMargin_px = 400;  // so wide that the whole image is compared

/// Grey values of the image as line integrals, and the radiograph's, at every pixel.
struct Images {
  std::vector<double> seen, rendered;
  double seen_at(int u, int v) const { return seen[std::size_t(v * kWidth + u)]; }
};

marrow::View view() { return blob_scene::view_of(50000, 0.02, 60); }

Images images_at(double du, double dv) {
  Images images;
  const marrow::View image = view();
  double brightest = 0;
  cv::minMaxLoc(image.image.pixels, nullptr, &brightest);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      images.seen.push_back(-std::log(image.image.pixels.at<std::uint16_t>(v, u) / brightest));
      images.rendered.push_back(blob_scene::blobs(u - du, v - dv));
    }
  return images;
}

double mean(const std::vector<double>& x) { return std::accumulate(x.begin(), x.end(), 0.0) / double(x.size()); }
double covariance(const std::vector<double>& x, const std::vector<double>& y) {
  const double a = mean(x), b = mean(y);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - a) * (y[i] - b);
  return sum / double(x.size());
}
double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  return covariance(x, y) / std::sqrt(covariance(x, x) * covariance(y, y));
}
/// Sobel's gradient divided by 8, where all nine pixels are in the image.
std::array<std::vector<double>, 2> gradients(const std::vector<double>& image) {
  std::array<std::vector<double>, 2> g;
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
std::vector<double> difference(const Images& images, bool with_model = true) {
  const auto seen = gradients(images.seen), rendered = gradients(images.rendered);
  double products = 0, squares = 0;
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < seen[k].size(); ++i)
      products += seen[k][i] * rendered[k][i], squares += rendered[k][i] * rendered[k][i];
  const double s = with_model ? products / squares : 0;
  std::vector<double> d;
  for (std::size_t i = 0; i < images.seen.size(); ++i) d.push_back(images.seen[i] - s * images.rendered[i]);
  return d;
}

double entropy(const std::map<std::pair<int, int>, double>& histogram, double n) {
  double sum = 0;
  for (const auto& [bin, count] : histogram) sum -= count / n * std::log(count / n);
  return sum;
}
std::pair<double, double> range(const std::vector<double>& x) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  return {*low, *high};
}

/// The projector's region is the whole image.
class Everywhere : public blob_scene::BlobProjector {
 public:
  marrow::PixelGrid region(const marrow::Camera&, const marrow::RigidTransform&) const override {
    return {0, 0, 1, kWidth, kHeight};
  }
};

double value(const std::string& measure, double du, double dv, shipped::Options options = {}) {
  options["sigma_steps"] = 0.0;
  options["pixel_step"] = std::int64_t(1);
  options["margin_px"] = std::int64_t(kMargin_px);
  const shipped::Inputs in{
      {"projector", marrow::Value::of<marrow::RadiographProjector>(std::make_shared<const Everywhere>())},
      {"views", shipped::list(blob_scene::views_of(view()), "view")}};
  const marrow::Value cost = shipped::call("similarity." + measure, in, options).at("cost");
  return cost.as<marrow::Cost>().value(blob_scene::at(du, dv));
}

const std::vector<std::pair<double, double>> kPlaces{{0, 0}, {2, -1}, {-5, 6}};

TEST(Formulas, NormalisedCrossCorrelation) {
  for (const auto& [du, dv] : kPlaces) {
    const Images images = images_at(du, dv);
    EXPECT_NEAR(value("normalised_cross_correlation", du, dv), 1 - correlation(images.rendered, images.seen), 1e-5);
  }
}

TEST(Formulas, GradientCorrelation) {
  for (const auto& [du, dv] : kPlaces) {
    const Images images = images_at(du, dv);
    const auto seen = gradients(images.seen), rendered = gradients(images.rendered);
    EXPECT_NEAR(value("gradient_correlation", du, dv),
                1 - 0.5 * (correlation(rendered[0], seen[0]) + correlation(rendered[1], seen[1])), 1e-4);
  }
}

/// The cubic B-spline about 0.
double b_spline(double x) {
  const double a = std::abs(x);
  return a < 1 ? 2.0 / 3 - a * a * (1 - a / 2) : a < 2 ? std::pow(2 - a, 3) / 6 : 0;
}

TEST(Formulas, MutualInformation) {
  constexpr int kBins = 32;
  for (const auto& [du, dv] : kPlaces) {
    const Images images = images_at(du, dv);
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
    EXPECT_NEAR(value("mutual_information", du, dv), 2 - (entropy(of_a, n) + entropy(of_b, n)) / entropy(joint, n),
                1e-3)
        << "a value at a bin's border may fall into either";
  }
}

TEST(Formulas, EntropyOfDifference) {
  for (const auto& [du, dv] : kPlaces) {
    const Images images = images_at(du, dv);
    const auto [low, high] = range(images.seen);
    const auto entropy_of = [&, low = low, high = high](const std::vector<double>& d) {
      std::map<std::pair<int, int>, double> histogram;
      for (const double x : d) histogram[{std::min(64, int(std::floor(0.5 + 64 * (x - low) / (high - low)))), 0}] += 1;
      return entropy(histogram, kWidth * kHeight);
    };
    EXPECT_NEAR(value("entropy_of_difference", du, dv),
                std::min(2.0, entropy_of(difference(images)) / entropy_of(difference(images, false))), 1e-3);
  }
}

TEST(Formulas, PatternIntensity) {
  const int r = 2;
  const double sigma = 0.3;
  for (const auto& [du, dv] : kPlaces) {
    const Images images = images_at(du, dv);
    const double s2 = sigma * sigma * covariance(images.seen, images.seen);
    // P = the sum over pixels and their neighbours of s^2 / (s^2 + d^2); its largest value is the number of pairs.
    const auto pattern = [&](const std::vector<double>& d) {
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
    EXPECT_NEAR(value("pattern_intensity", du, dv, {{"radius_pixels", std::int64_t(r)}, {"sigma", sigma}}),
                std::min(2.0, pattern(difference(images)) / pattern(difference(images, false))), 1e-4);
  }
}

TEST(Formulas, GradientDifference) {
  for (const auto& [du, dv] : kPlaces) {
    const Images images = images_at(du, dv);
    const auto seen = gradients(images.seen), left = gradients(difference(images));
    const auto missing = [&](const std::array<std::vector<double>, 2>& g) {
      double sum = 0;
      for (int k = 0; k < 2; ++k) {
        const auto& of_image = seen[std::size_t(k)];
        const double variance = covariance(of_image, of_image);
        for (const double d : g[std::size_t(k)]) sum += 1 - variance / (variance + d * d);
      }
      return sum;
    };
    EXPECT_NEAR(value("gradient_difference", du, dv), std::min(2.0, missing(left) / missing(seen)), 1e-4);
  }
}

TEST(Formulas, WhatTheModelDoesNotReachCountsAsWell) {
  // The value is the same whether the whole image is compared or only the model's surroundings, because the sums are
  // over a fixed region.
  for (const std::string measure : {"pattern_intensity", "gradient_difference", "entropy_of_difference"}) {
    const auto near = [&](double du, double dv) {
      const shipped::Inputs in{
          {"projector",
           marrow::Value::of<marrow::RadiographProjector>(std::make_shared<const blob_scene::BlobProjector>())},
          {"views", shipped::list(blob_scene::views_of(blob_scene::view_of(50000, 0.02, 0)), "view")}};
      return shipped::call("similarity." + measure, in,
                           {{"pixel_step", std::int64_t(1)}, {"sigma_steps", 0.0}, {"margin_px", std::int64_t(16)}})
          .at("cost")
          .as<marrow::Cost>()
          .value(blob_scene::at(du, dv));
    };
    EXPECT_LT(near(0, 0), 0.35) << measure << ": next to nothing is left";
    EXPECT_GT(near(60, 40), 0.95) << measure << ": where the image is even, the model explains nothing";
  }
}

}  // namespace formulas_test
