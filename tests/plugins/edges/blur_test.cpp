// SPDX-License-Identifier: Apache-2.0
#include <opencv2/imgproc.hpp>

#include "marrow/similarity/blur.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::blur_test {

constexpr int kSize_px = 240;

/// exp(-line integral) in 16 bits, with noise of this standard deviation in grey values.
template <class LineIntegral>
cv::Mat image_of(const LineIntegral& line_integral, double noise) {
  cv::Mat image(kSize_px, kSize_px, CV_16U);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
  for (int v = 0; v < kSize_px; ++v)
    for (int u = 0; u < kSize_px; ++u)
      image.at<std::uint16_t>(v, u) = std::uint16_t(
          std::clamp(60000 * std::exp(-line_integral(u, v)) + (noise > 0 ? normal(random) : 0.0), 0.0, 65535.0));
  return image;
}

/// Edges along a line through the middle of the image, whose bright side is at `angle`.
EdgeMap edges_at(double angle, double inside_px = 0) {
  EdgeMap edges{kSize_px, kSize_px, {}};
  const double du = std::cos(angle), dv = std::sin(angle);
  for (int along = -80; along <= 80; ++along)
    edges.pixels.push_back(
        {float(120 - inside_px * du - along * dv), float(120 - inside_px * dv + along * du), float(du), float(dv), 1});
  return edges;
}

TEST(Blur, OfAStep) {
  for (const double sigma : {1.0, 2.0, 4.0})
    for (const double angle : {0.0, 0.4, 2.0})
      for (const double noise : {0.0, 300.0}) {
        const cv::Mat image = image_of(
            [&](int u, int v) {
              const double way = (u - 120) * std::cos(angle) + (v - 120) * std::sin(angle);
              return 0.2 + 0.4 * std::erfc(way / (sigma * std::sqrt(2.0)));
            },
            noise);
        EXPECT_NEAR(image::blur_px(image, edges_at(angle)), sigma, noise > 0 ? 0.15 * sigma : 0.08)
            << sigma << " px at " << angle << " with noise " << noise;
      }
}

TEST(Blur, ARoundBonesBorderIsSteepestInsideItsSilhouette) {
  // The path grows with the square root of the distance s = q^2 inside the silhouette. So its slope, blurred by a
  // Gaussian of 1 px, is the integral of exp(-(x - q^2)^2 / 2) over q, up to a factor.
  double steepest = 0, at = 0;
  for (double x = 0; x < 2; x += 0.005) {
    double slope = 0;
    for (double q = 0; q < 4; q += 0.001) slope += std::exp(-0.5 * (x - q * q) * (x - q * q));
    if (slope > steepest) steepest = slope, at = x;
  }
  EXPECT_NEAR(at, image::border_inside_px(1), 0.01);
  EXPECT_EQ(image::border_inside_px(3), 3 * image::border_inside_px(1));
}

TEST(Blur, OfTooFewEdgesIsNone) {
  EdgeMap few = edges_at(0);
  few.pixels.resize(19);
  const cv::Mat image = image_of([](int u, int) { return u < 120 ? 1.0 : 0.2; }, 0);
  EXPECT_EQ(image::blur_px(image, few), 0);
  EXPECT_EQ(image::blur_px(image, {}), 0);
  EXPECT_EQ(image::blur_px({}, edges_at(0)), 0);
}

}  // namespace marrow::test::blur_test
