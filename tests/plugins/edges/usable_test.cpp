// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/toolbox/image/field_of_view.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::usable_test {

using namespace image;

/// A limb with a bone across a round field of the given radius; beyond the field is scatter, and the outline is
/// blurred.
cv::Mat collimated(double radius, double scatter, bool limb = true) {
  cv::Mat grey(400, 480, CV_32F);
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 1);
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u) {
      const double across = std::abs(u + 0.3 * v - 300);
      double value = 50000;
      if (limb) value *= across < 30 ? 0.15 : across < 120 ? 0.3 : 1.0;
      const double inside = 1 / (1 + std::exp(std::hypot(u - 243.4, v - 196.2) - radius));
      value = 200 + value * inside + scatter * (1 - inside) * (1 + std::sin(0.05 * u) * std::sin(0.04 * v));
      grey.at<float>(v, u) = float(value) + float(std::sqrt(value)) * noise(random);
    }
  return grey;
}

std::optional<Field> field_of(const cv::Mat& grey) {
  double largest = 0;
  cv::minMaxLoc(grey, nullptr, &largest);
  return collimator_field(grey, largest);
}

void expect_outline(const cv::Mat& grey, double radius) {
  const auto field = field_of(grey);
  ASSERT_TRUE(field);
  double worst = 0;
  for (int i = 0; i < 360; ++i) {
    const double angle = 2 * kPi * i / 360, r = field->radius(angle);
    const cv::Point2d at = field->centre + r * cv::Point2d(std::cos(angle), std::sin(angle));
    if (at.x < 0 || at.y < 0 || at.x > grey.cols - 1 || at.y > grey.rows - 1) continue;
    worst = std::max(worst, std::abs(std::hypot(at.x - 243.4, at.y - 196.2) - radius));
  }
  std::printf("radius %.0f: outline within %.2f px\n", radius, worst);
  EXPECT_LT(worst, 1.5);
}

TEST(Usable, FindsTheFieldOfARoundCollimator) {
  expect_outline(collimated(170, 0), 170);
  expect_outline(collimated(170, 1500), 170);
  expect_outline(collimated(170, 4000, false), 170);
}

TEST(Usable, FindsAFieldOfWhichTheImageHoldsArcsOnly) { expect_outline(collimated(230, 1000), 230); }

TEST(Usable, TakesNoLimbOrBrightCornerForACollimator) {
  EXPECT_FALSE(field_of(collimated(1000, 0)));
  cv::Mat grey = collimated(1000, 0, false);
  cv::circle(grey, {240, 200}, 120, 3000.0f, -1);  // dark inside, not outside
  EXPECT_FALSE(field_of(grey));
  grey = cv::Mat(400, 480, CV_32F, cv::Scalar(2000));  // dark corners and a bright square
  grey(cv::Rect(100, 80, 250, 220)) = 50000;
  EXPECT_FALSE(field_of(grey));
}

TEST(Usable, TakesNoArcInTheLitFieldOfARectangularCollimatorForOne) {
  cv::Mat grey(400, 480, CV_32F, cv::Scalar(8000));
  for (int v = 20; v < 380; ++v)
    for (int u = 20; u < 460; ++u)
      grey.at<float>(v, u) = std::hypot(u - 243.4, v - 236.2) < 160 ? 50000.0f : 15000.0f;  // a thick limb, say
  EXPECT_FALSE(field_of(grey));
}

TEST(Usable, LeavesAMarginEverywhere) {
  View view;
  const cv::Mat grey = collimated(170, 1500);
  double smallest = 0, largest = 0;
  cv::minMaxLoc(grey, &smallest, &largest);
  const cv::Mat usable = usable_pixels(view, grey, smallest, largest, 5);
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u) {
      const double inside = 170 - std::hypot(u - 243.4, v - 196.2);
      if (inside < 7) {
        ASSERT_EQ(usable.at<uchar>(v, u), 0) << u << " " << v;
      } else if (inside > 11) {
        ASSERT_NE(usable.at<uchar>(v, u), 0) << u << " " << v;
      }
    }
}

// Real frames of a knee (Brown University, see the data folder's README); their outlines were read off the pictures.
TEST(Usable, FindsTheFieldOfRealFrames) {
  const std::string folder = MARROW_SOURCE_DIR "/../shared/data/knee/images/";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the real knee is not here: " << folder;
  for (const auto& [name, right, other] :
       {std::tuple<std::string, double, double>{"L_Hop_Cam1_001_UND.0138.tif", 1736, 1752},
        {"L_Hop_Cam2_001_UND.0138.tif", 1750, 13}}) {
    cv::Mat grey;
    cv::imread(folder + name, cv::IMREAD_GRAYSCALE).convertTo(grey, CV_32F);
    const auto field = field_of(grey);
    ASSERT_TRUE(field) << name;
    const double down = other > 880 ? 1 : -1;
    const double at_right = field->centre.x + field->radius(0),
                 at_other = field->centre.y + down * field->radius(down * kPi / 2);
    std::printf("%s: radius %.1f about %.1f, %.1f; right end at %.1f, %s at %.1f\n", name.c_str(), field->harmonics[0],
                field->centre.x, field->centre.y, at_right, down > 0 ? "lower" : "upper", at_other);
    EXPECT_NEAR(at_right, right, 4);
    EXPECT_NEAR(at_other, other, 4);
  }
}

}  // namespace marrow::test::usable_test
