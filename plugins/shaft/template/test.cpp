// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, FindsTheBordersOfAnUprightShaft) {
  constexpr int kLeft_px = 215, kRight_px = 295;  // 80 px of 0.586 mm, magnified by 1000 / 600: 28.1 mm
  marrow::View view;
  view.name = "frontal";
  const marrow::CArm arm{512, 512, Eigen::Vector2d::Constant(0.586), 1000, 600, Eigen::Vector3d::Zero()};
  view.camera = marrow::carm_camera(arm, marrow::world_from_camera_rotation(0, 0));
  view.image.pixels = cv::Mat(512, 512, CV_16U, cv::Scalar(1000));
  view.image.pixels.colRange(kLeft_px, kRight_px) = 500;
  marrow::EdgeMap edges{512, 512, {}};
  for (int v = 20; v < 480; ++v) {  // gradients point to the bright side
    edges.pixels.push_back({float(kLeft_px), float(v), -1, 0, 100});
    edges.pixels.push_back({float(kRight_px), float(v), 1, 0, 100});
  }
  // The borders of this drawing are sharp. Those of a bone are drawn inwards by blur, which 'outline' corrects.
  const auto lines =
      node_test::call("shaft.new_node", {{"edges", node_test::item(edges)}, {"view", node_test::item(view)}},
                      {{"outline", false}})
          .at("lines")
          .as<marrow::ShaftLines>();
  EXPECT_NEAR(lines.width_mm, 28.1, 0.5);
  EXPECT_NEAR(lines.left.from_px.x(), kRight_px, 1);  // seen down the image, the left border is at larger u
  EXPECT_NEAR(lines.right.from_px.x(), kLeft_px, 1);
}
