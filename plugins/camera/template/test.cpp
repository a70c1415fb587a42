// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/camera.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, ShowsTheIsocentreInTheMiddleAndMagnifiesByTheDistances) {
  const node_test::Options options{{"names", std::vector<std::string>{"frontal"}},
                                   {"alpha_deg", std::vector<double>{0}},
                                   {"beta_deg", std::vector<double>{0}}};
  const auto cameras = node_test::call("camera.new_node", {}, options).at("camera").as_list<marrow::Camera>();
  ASSERT_EQ(cameras.size(), 1u);
  const Eigen::Vector2d middle = marrow::project(cameras[0], {0, 0, 0}),
                        below = marrow::project(cameras[0], {0, 0, -9});
  EXPECT_NEAR(middle.x(), 255.5, 1e-9);
  EXPECT_NEAR(middle.y(), 255.5, 1e-9);
  EXPECT_NEAR(below.y() - middle.y(), 9 * 1000 / 600.0 / 0.586, 1e-6);  // the head is up
}
