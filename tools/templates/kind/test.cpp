#include <gtest/gtest.h>

#include <marrow/domain/camera.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewKind, MedianRemovesASinglePixel) {
  marrow::View view;
  view.name = "dot";
  view.camera.width_px = view.camera.height_px = 16;
  view.image.pixels = cv::Mat(16, 16, CV_16U, cv::Scalar(1000));
  view.image.pixels.at<std::uint16_t>(8, 8) = 60000;
  const auto result =
      node_test::call("new_kind.median", {{"view", node_test::item(view)}}).at("view").as<marrow::View>();
  EXPECT_EQ(result.image.pixels.at<std::uint16_t>(8, 8), 1000);
  EXPECT_EQ(result.image.pixels.size(), cv::Size(16, 16));
}
