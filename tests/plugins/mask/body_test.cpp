// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/plan/implants.hpp"

namespace marrow::test::mask_body_test {

TEST(MaskBody, LeavesOutTheBodyAndAMargin) {
  const Value volume = call("volume.filled_surface", {{"mesh", item(implants::rod().surface)}}).at("volume");
  const Value projector = call("project.joseph", {{"volume", volume}}).at("projector");
  View view = implants::views()[0];
  view.mask = cv::Mat(512, 512, CV_8U, cv::Scalar(255));
  view.mask.at<std::uint8_t>(7, 9) = 0;
  const auto mask_of = [&](int margin_px) {
    return output<View>("mask.body", "view",
                        {{"view", item(view)},
                         {"projector", projector},
                         {"pose", item(implants::pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0}))}},
                        {{"margin_px", margin_px}})
        .mask;
  };
  // The rod is 10 mm wide: 10 * 1000 / 600 / 0.586 = 28.4 px around the middle column 255.5.
  const cv::Mat close = mask_of(0), wide = mask_of(6);
  const auto at = [](const cv::Mat& mask, int u) { return int(mask.at<std::uint8_t>(256, u)); };
  EXPECT_EQ(at(close, 255), 0);
  EXPECT_EQ(at(close, 242), 0);
  EXPECT_EQ(at(close, 238), 255);
  EXPECT_EQ(at(wide, 238), 0);
  EXPECT_EQ(at(wide, 232), 255);
  EXPECT_EQ(int(close.at<std::uint8_t>(7, 9)), 0) << "what was left out stays so";
  EXPECT_EQ(int(close.at<std::uint8_t>(20, 255)), 255) << "beyond the rod's end";
}

/// What is left of a view within 10 mm of a rod's hole.
cv::Mat near_hole(const View& view) {
  return output<View>("mask.near_holes", "view",
                      {{"view", item(view)},
                       {"implant", item(implants::rod())},
                       {"pose", item(implants::pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0}))}},
                      {{"reach_mm", 10.0}})
      .mask;
}

TEST(MaskNearHoles, KeepsOnlyWhatIsNearAHole) {
  View view = implants::views()[0];
  view.mask = cv::Mat(512, 512, CV_8U, cv::Scalar(255));
  view.mask.at<std::uint8_t>(256, 256) = 0;
  const cv::Mat mask = near_hole(view);
  // The hole is in the middle of the image. 10 mm are 10 * 1000 / 600 / 0.586 = 28.4 px.
  EXPECT_EQ(int(mask.at<std::uint8_t>(256, 250)), 255);
  EXPECT_EQ(int(mask.at<std::uint8_t>(256, 256)), 0) << "what was left out stays so";
  EXPECT_EQ(int(mask.at<std::uint8_t>(256 + 26, 256)), 255);
  EXPECT_EQ(int(mask.at<std::uint8_t>(256 + 32, 256)), 0);
  EXPECT_EQ(int(mask.at<std::uint8_t>(256, 256 - 32)), 0);
}

TEST(MaskNearHoles, KeepsADiscInThePatientAlsoWherePixelsAreNotSquare) {
  View view = implants::views()[0];
  view.camera.intrinsics.row(1) *= 0.5;  // pixels twice as high as wide
  const cv::Mat mask = near_hole(view);
  // The hole is at (255.5, 127.75). 10 mm are 28.4 px along u and 14.2 px along v.
  const auto at = [&](int u, int v) { return int(mask.at<std::uint8_t>(v, u)); };
  EXPECT_EQ(at(255 + 28, 128), 255);
  EXPECT_EQ(at(255 + 30, 128), 0);
  EXPECT_EQ(at(256, 127 + 14), 255);
  EXPECT_EQ(at(256, 127 + 16), 0);
  EXPECT_NEAR(cv::countNonZero(mask), kPi * 28.44 * 14.22, 15);
}

}  // namespace marrow::test::mask_body_test
