// SPDX-License-Identifier: Apache-2.0
// Grey values in steps: air 60000, a limb 30000 with a stripe of bone 20000, two plates of metal 5000 and 4500 in it, a
// cable as dark, and the dark outside of the field at the border.
#include "tests/harness/node_test.hpp"

namespace marrow::test::mask_threshold_test {

const cv::Rect kLarge(60, 70, 40, 30), kSmall(110, 80, 20, 20);

View view() {
  View view{"front", {cv::Mat(200, 200, CV_16U, cv::Scalar(60000))}, {}, {}};
  view.camera.width_px = view.camera.height_px = 200;
  view.camera.intrinsics << 900, 0, 99.5, 0, 900, 99.5, 0, 0, 1;
  cv::Mat& pixels = view.image.pixels;
  pixels(cv::Rect(40, 0, 110, 200)).setTo(30000);
  pixels(cv::Rect(70, 0, 20, 200)).setTo(20000);
  pixels(kLarge).setTo(5000);
  pixels(kSmall).setTo(4500);
  pixels(cv::Rect(0, 85, 200, 3)).setTo(5000);  // a cable through both
  pixels(cv::Rect(0, 190, 200, 10)).setTo(1000);
  return view;
}

/// Within a pixel at each side: an opening leaves the pixels of the cable that touch a plate.
void expect_box(const cv::Rect& box, const cv::Rect& expected) {
  const cv::Rect wider(expected.x - 1, expected.y - 1, expected.width + 2, expected.height + 2);
  EXPECT_EQ(box | expected, box) << box << " is smaller than " << expected;
  EXPECT_EQ(box & wider, box) << box << " is larger than " << expected;
}

/// The box of what is kept, and how much of it is kept.
std::pair<cv::Rect, int> kept(const View& view, const Options& options) {
  const cv::Mat mask = output<View>("mask.threshold", "view", {{"view", item(view)}}, options).mask;
  cv::Rect box;
  for (int v = 0; v < mask.rows; ++v)
    for (int u = 0; u < mask.cols; ++u)
      if (mask.at<std::uint8_t>(v, u)) box |= cv::Rect(u, v, 1, 1);
  return {box, cv::countNonZero(mask)};
}

TEST(MaskThreshold, KeepsTheLargestRegionOfMetal) {
  const auto [box, pixels] = kept(view(), {});
  expect_box(box, kLarge);  // the cable is cut off, the outside touches the border
  EXPECT_NEAR(pixels, kLarge.area(), 20) << "an opening rounds the corners";
}

TEST(MaskThreshold, KeepsTheSecondRegion) { expect_box(kept(view(), {{"region", 2}}).first, kSmall); }

TEST(MaskThreshold, KeepsTheOutsideIfAsked) {
  EXPECT_EQ(kept(view(), {{"at_border", true}, {"grey_value", 2000.0}}).first, cv::Rect(0, 190, 200, 10));
}

TEST(MaskThreshold, TakesImagesOf8Bits) {
  View small = view();
  small.image.pixels.convertTo(small.image.pixels, CV_8U, 1.0 / 256);
  expect_box(kept(small, {}).first, kLarge);
}

TEST(MaskThreshold, TakesTheGivenValue) {
  View no_cable = view();
  no_cable.image.pixels(cv::Rect(0, 85, 200, 3)).setTo(30000);
  no_cable.image.pixels(kSmall).setTo(4500);
  expect_box(kept(no_cable, {{"grey_value", 4800.0}}).first, kSmall);  // the larger plate is brighter
}

TEST(MaskThreshold, LeavesOutSmallRegions) {
  // The smaller plate has 1 % of the image.
  EXPECT_NE(refusal("mask.threshold", {{"view", item(view())}}, {{"region", 2}, {"least_percent", 1.5}}), "");
}

TEST(MaskThreshold, KeepsWhatIsBright) {
  View inverse = view();
  inverse.image.pixels = 65535 - inverse.image.pixels;
  expect_box(kept(inverse, {{"bright", true}}).first, kLarge);
}

TEST(MaskThreshold, LeavesOutWhatWasLeftOut) {
  View masked = view();
  masked.mask = cv::Mat(200, 200, CV_8U, cv::Scalar(255));
  masked.mask(kLarge).setTo(0);
  expect_box(kept(masked, {{"grey_value", 10000.0}}).first, kSmall);
}

TEST(MaskThreshold, SaysIfThereAreTooFewRegions) {
  EXPECT_EQ(refusal("mask.threshold", {{"view", item(view())}}, {{"region", 3}}),
            "mask.threshold: view 'front': no grey value gives 3 regions away from the image's border; give a "
            "grey_value, or another mask");
}

}  // namespace marrow::test::mask_threshold_test
