// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/camera.hpp>
#include <marrow/domain/functions.hpp>
#include <marrow/domain/volume.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, ARayThroughABallOfWaterIsAsLongAsTheBallIsThick) {
  marrow::Volume ball;  // a radius of 20 mm about the world's origin
  ball.grid.size = {64, 64, 64};
  ball.grid.origin_mm = Eigen::Vector3d::Constant(-31.5);
  for (int z = 0; z < 64; ++z)
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x)
        ball.values.push_back(ball.grid.point_from_index({double(x), double(y), double(z)}).norm() < 20 ? 0 : -1000);
  const auto made = node_test::call("project.new_node", {{"volume", node_test::item(ball)}});
  const auto& projector = made.at("projector").as<marrow::RadiographProjector>();
  const marrow::CArm arm{512, 512, Eigen::Vector2d::Constant(0.5), 1000, 600, Eigen::Vector3d::Zero()};
  const marrow::Camera camera = marrow::carm_camera(arm, marrow::world_from_camera_rotation(0, 0));
  const marrow::RigidTransform in_place{"world", "ct"};
  const float outside_px = 255.5f + 30 * 1000 / 600.0f / 0.5f;
  const auto values = projector.radiograph(camera, in_place, {{255.5f, 255.5f}, {outside_px, 255.5f}});
  EXPECT_NEAR(values[0], 40, 0.8);  // mm of water
  EXPECT_NEAR(values[1], 0, 0.01);
}
