// SPDX-License-Identifier: Apache-2.0
#include "plugins/render/shaft.cpp"

#include <gtest/gtest.h>

namespace {

marrow::View view() {
  marrow::View view;
  view.name = "frontal";
  view.image.pixels = cv::Mat(100, 100, CV_8U, cv::Scalar(77));
  view.camera.width_px = view.camera.height_px = 100;
  return view;
}

marrow::ShaftLines lines() {
  marrow::ShaftLines lines;
  lines.left = {{30, 10}, {30, 90}};
  lines.right = {{60, 10}, {60, 90}};
  lines.width_mm = 27.3;
  lines.width_deviation_mm = 1.4;
  lines.log_likelihood = -1.25;
  lines.rejected = {{{{40, 10}, {40, 90}}, {{50, 10}, {50, 90}}, "10.0 mm wide: the marrow canal"},
                    {{{80, 10}, {80, 90}}, {{85, 10}, {85, 90}}, "5.0 mm wide: too narrow"}};
  return lines;
}

bool has(const cv::Mat& picture, cv::Point pixel, const cv::Scalar& colour) {
  const auto value = picture.at<cv::Vec3b>(pixel);
  return std::abs(value[0] - colour[0]) < 40 && std::abs(value[1] - colour[1]) < 40 &&
         std::abs(value[2] - colour[2]) < 40;
}

// Pixel u of the image has its centre at 5 u + 2 in a panel of five times the size.
Options five_times() {
  Options options;
  options.size_px = 500;
  return options;
}

TEST(RenderShaft, ChosenAndRejectedPairsHaveTheirColours) {
  const cv::Mat picture = shaft(lines(), view(), nullptr, five_times()).pixels;
  EXPECT_TRUE(has(picture, {152, 250}, kSkyBlue));
  EXPECT_TRUE(has(picture, {302, 250}, kSkyBlue));
  EXPECT_TRUE(has(picture, {202, 250}, kOrange));
  EXPECT_TRUE(has(picture, {427, 250}, kOrange));
}

TEST(RenderShaft, TheLineMidwayIsDrawn) {
  EXPECT_TRUE(has(shaft(lines(), view(), nullptr, five_times()).pixels, {227, 250}, kSkyBlue));
}

TEST(RenderShaft, DrawsNoMoreRejectedPairsThanAsked) {
  Options options = five_times();
  options.rejected = 1;
  const cv::Mat picture = shaft(lines(), view(), nullptr, options).pixels;
  EXPECT_TRUE(has(picture, {202, 250}, kOrange));
  EXPECT_FALSE(has(picture, {427, 250}, kOrange));
  options.rejected = 0;
  EXPECT_FALSE(has(shaft(lines(), view(), nullptr, options).pixels, {202, 250}, kOrange));
}

TEST(RenderShaft, TellsWidthAndScore) {
  EXPECT_EQ(describe(lines()), "chosen: 27.3 +- 1.4 mm wide, log likelihood -1.25");
}

TEST(RenderShaft, LinesThatAreNotFiniteDrawNothing) {
  marrow::ShaftLines broken = lines();
  broken.left.from_px.x() = broken.rejected[0].left.from_px.y() = std::nan("");
  EXPECT_FALSE(shaft(broken, view(), nullptr, five_times()).pixels.empty());
}

}  // namespace
