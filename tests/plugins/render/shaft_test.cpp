// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/draw/canvas.hpp"
#include "tests/plugins/render/pictures.hpp"

namespace marrow::test::shaft_test {

using namespace draw;
using pictures::has;

View view() {
  View view;
  view.name = "frontal";
  view.image.pixels = cv::Mat(100, 100, CV_8U, cv::Scalar(77));
  view.camera.width_px = view.camera.height_px = 100;
  return view;
}

ShaftLines lines() {
  ShaftLines lines;
  lines.left = {{30, 10}, {30, 90}};
  lines.right = {{60, 10}, {60, 90}};
  lines.width_mm = 27.3;
  lines.width_deviation_mm = 1.4;
  lines.log_likelihood = -1.25;
  lines.rejected = {{{{40, 10}, {40, 90}}, {{50, 10}, {50, 90}}, "10.0 mm wide: the marrow canal"},
                    {{{80, 10}, {80, 90}}, {{85, 10}, {85, 90}}, "5.0 mm wide: too narrow"}};
  return lines;
}

// Pixel u of the image has its centre at 5 u + 2 in a panel of five times the size.
const Options kFiveTimes{{"size_px", std::int64_t{500}}};

cv::Mat shaft(const ShaftLines& lines, const Options& options = kFiveTimes) {
  return output<Picture>("render.shaft", "picture", {{"lines", item(lines)}, {"view", item(view())}}, options).pixels;
}

TEST(RenderShaft, ChosenAndRejectedPairsHaveTheirColours) {
  const cv::Mat picture = shaft(lines());
  EXPECT_TRUE(has(picture, {152, 250}, kSkyBlue));
  EXPECT_TRUE(has(picture, {302, 250}, kSkyBlue));
  EXPECT_TRUE(has(picture, {202, 250}, kOrange));
  EXPECT_TRUE(has(picture, {427, 250}, kOrange));
}

TEST(RenderShaft, TheLineMidwayIsDrawn) { EXPECT_TRUE(has(shaft(lines()), {227, 250}, kSkyBlue)); }

TEST(RenderShaft, DrawsNoMoreRejectedPairsThanAsked) {
  Options options = kFiveTimes;
  options["rejected"] = std::int64_t{1};
  const cv::Mat picture = shaft(lines(), options);
  EXPECT_TRUE(has(picture, {202, 250}, kOrange));
  EXPECT_FALSE(has(picture, {427, 250}, kOrange));
  options["rejected"] = std::int64_t{0};
  EXPECT_FALSE(has(shaft(lines(), options), {202, 250}, kOrange));
}

TEST(RenderShaft, TellsWidthAndScore) {
  const cv::Mat picture = shaft(lines(), {{"size_px", std::int64_t{1000}}});
  EXPECT_TRUE(pictures::has_legend(picture, 1000,
                                   {{"chosen: 27.3 +- 1.4 mm wide, log likelihood -1.25", kSkyBlue},
                                    {"rejected 1: 10.0 mm wide: the marrow canal", kOrange},
                                    {"rejected 2: 5.0 mm wide: too narrow", kOrange}}));
}

TEST(RenderShaft, LinesThatAreNotFiniteDrawNothing) {
  ShaftLines broken = lines();
  broken.left.from_px.x() = broken.rejected[0].left.from_px.y() = std::nan("");
  EXPECT_FALSE(shaft(broken).empty());
}

}  // namespace marrow::test::shaft_test
