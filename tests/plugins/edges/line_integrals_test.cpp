// SPDX-License-Identifier: Apache-2.0
#include <opencv2/core.hpp>

#include "marrow/toolbox/image/line_integrals.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::line_integrals_test {

using image::GreyScale;
using image::line_integrals;

TEST(LineIntegrals, AreLogarithmsOfWhatIsLeft) {
  const cv::Mat grey = (cv::Mat_<std::uint16_t>(1, 5) << 1000, 500, 5, 4, 0);
  const cv::Mat values = line_integrals(grey);
  ASSERT_EQ(values.type(), CV_32FC1);
  EXPECT_EQ(values.at<float>(0), 0);
  EXPECT_FLOAT_EQ(values.at<float>(1), std::log(2.0f));
  for (int dark = 2; dark < 5; ++dark)
    EXPECT_FLOAT_EQ(values.at<float>(dark), std::log(200.0f)) << "at most that of a two-hundredth of the brightest";
}

TEST(LineIntegrals, OfEachType) {
  const cv::Mat bytes = (cv::Mat_<std::uint8_t>(1, 2) << 200, 50);
  EXPECT_FLOAT_EQ(line_integrals(bytes).at<float>(1), std::log(4.0f));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat real = (cv::Mat_<float>(1, 4) << 0.5f, 0.25f, -0.001f, nan);
  const cv::Mat values = line_integrals(real);
  EXPECT_FLOAT_EQ(values.at<float>(1), std::log(2.0f));
  EXPECT_FLOAT_EQ(values.at<float>(2), std::log(200.0f));
  EXPECT_TRUE(std::isnan(values.at<float>(3)));
}

TEST(LineIntegrals, OfOneValueAreThoseOfTheImage) {
  const cv::Mat grey = (cv::Mat_<float>(1, 4) << 7.0f, 3.0f, 0.001f, -0.02f);
  const GreyScale scale(grey);
  EXPECT_EQ(scale.air(), 7);
  EXPECT_EQ(scale.dark(), 0);
  const cv::Mat values = line_integrals(grey);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(scale.line_integral(double(grey.at<float>(i))), double(values.at<float>(i)), 1e-6) << i;
  EXPECT_TRUE(std::isnan(scale.line_integral(std::numeric_limits<double>::quiet_NaN())));
}

TEST(LineIntegrals, WithoutLightAreThoseOfDarkPixels) {
  const cv::Mat black(2, 2, CV_16U, cv::Scalar(0)), negative(2, 2, CV_32F, cv::Scalar(-3));
  for (const cv::Mat& image : {black, negative}) {
    const cv::Mat values = line_integrals(image);
    for (int i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(values.at<float>(i / 2, i % 2), std::log(200.0f));
  }
}

}  // namespace marrow::test::line_integrals_test
