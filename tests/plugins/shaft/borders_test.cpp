// SPDX-License-Identifier: Apache-2.0
#include <opencv2/imgproc.hpp>

#include "marrow/shaft/border.hpp"
#include "marrow/shaft/widths.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::borders_test {

using namespace shaft;
using shaft::Widths;

constexpr double kPixel_mm = 0.35, kWidth_px = 80, kLeft = 150.3;

/// A round bone that stands upright from u = 150.3 to 230.3, blurred, with a noise of 1 %.
cv::Mat image(double blur_px, double per_px = 0.01) {
  cv::Mat fine(400, 8 * 400, CV_32F);  // eight samples a pixel
  for (int u = 0; u < fine.cols; ++u) {
    const double depth = (u + 0.5) / 8 - 0.5 - kLeft;
    const double chord = depth > 0 && depth < kWidth_px ? 2 * std::sqrt(depth * (kWidth_px - depth)) : 0;
    fine.col(u) = 20000 * std::exp(-per_px * chord);
  }
  cv::Mat pixels;
  cv::GaussianBlur(fine, fine, {0, 0}, 8 * blur_px, 0.001);
  cv::resize(fine, pixels, {400, 400}, 0, 0, cv::INTER_AREA);
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 200);
  for (float& value : cv::Mat_<float>(pixels)) value += noise(random);
  pixels.convertTo(pixels, CV_16U);
  return pixels;
}

struct Found {
  EdgeMap edges{400, 400, {}};
  Border border;
  Stretch stretch{Vector2d::UnitY(), 50, 350};
};

/// Edges of the left border, so far inside its outline.
Found edges_inside(double inside_px) {
  Found found;
  for (int v = 0; v < 400; ++v) found.edges.pixels.push_back({float(kLeft + inside_px), float(v), -1, 0, 100});
  found.border = {{-1, 0}, -(kLeft + inside_px), 400, 0.1};
  return found;
}

std::optional<double> beyond_px(const cv::Mat& image, const Found& found) {
  return outline_beyond_edges_px(image, found.edges, found.border, {3, 0.97}, found.stretch, kWidth_px, kPixel_mm);
}

TEST(Outline, IsFoundBeyondEdgesThatBlurDrewInwards) {
  for (const double blur_px : {0.6, 1.0, 1.6})
    for (const double inside_px : {0.0, 0.5, 1.2, 2.0}) {
      const auto found = beyond_px(image(blur_px), edges_inside(inside_px));
      ASSERT_TRUE(found);
      std::printf("blurred by %.1f px, edges %.1f px inside: %.2f\n", blur_px, inside_px, *found);
      EXPECT_NEAR(*found, inside_px, 0.2);
    }
}

TEST(Outline, IsNotMadeUp) {
  const Found found = edges_inside(0);
  EXPECT_FALSE(beyond_px(cv::Mat(400, 400, CV_16U, cv::Scalar(0)), found));  // no logarithm
  EXPECT_FALSE(beyond_px(image(1, -0.01), found));                           // brighter inside
  EXPECT_FALSE(beyond_px(image(1), edges_inside(5)));                        // farther than edges can be off
  EXPECT_FALSE(outline_beyond_edges_px(image(1), {400, 400, {}}, found.border, {3, 0.97}, found.stretch, kWidth_px,
                                       kPixel_mm));  // no edges
}

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

}  // namespace marrow::test::borders_test
