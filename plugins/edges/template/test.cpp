// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, FindsAStepWhereItIs) {
  constexpr double kStep_px = 31.7;
  marrow::View view;
  view.name = "step";
  view.camera.width_px = view.camera.height_px = 64;
  view.image.pixels = cv::Mat(64, 64, CV_16U);
  for (int u = 0; u < 64; ++u)
    view.image.pixels.col(u) = std::round(25000 + 5000 * std::erf((u - kStep_px) / std::sqrt(2.0)));
  const auto edges =
      node_test::call("edges.new_node", {{"view", node_test::item(view)}}).at("edges").as<marrow::EdgeMap>();
  EXPECT_GE(edges.pixels.size(), 50u);
  for (const marrow::EdgePixel& edge : edges.pixels) {
    EXPECT_NEAR(edge.u_px, kStep_px, 0.25);
    EXPECT_NEAR(edge.direction_u, 1, 0.01);  // towards the brighter side
  }
}
