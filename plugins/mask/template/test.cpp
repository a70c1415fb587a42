// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, LeavesOutAPlateOfMetal) {
  marrow::View view;
  view.name = "frontal";
  view.camera.width_px = view.camera.height_px = 200;
  view.camera.intrinsics << 1000, 0, 99.5, 0, 1000, 99.5, 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 600};
  view.image.pixels = cv::Mat(200, 200, CV_16U, cv::Scalar(20000));
  view.image.pixels.rowRange(0, 10).setTo(50000);              // air
  view.image.pixels(cv::Rect(60, 80, 40, 20)).setTo(2000);     // metal
  view.image.pixels(cv::Rect(120, 30, 25, 150)).setTo(12000);  // bone
  const auto mask =
      node_test::call("mask.new_node", {{"view", node_test::item(view)}}).at("view").as<marrow::View>().mask;
  const auto at = [&](int u, int v) { return int(mask.at<std::uint8_t>(v, u)); };
  EXPECT_EQ(at(80, 90), 0);
  EXPECT_EQ(at(60, 80), 0) << "its corner";
  EXPECT_EQ(at(132, 100), 255) << "bone stays";
  EXPECT_EQ(at(40, 90), 255);
}
