// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, MakesABallOfItsSize) {
  constexpr double kRadius_mm = 10;
  const Eigen::Vector3d centre(15.2, 15.7, 16.1);
  marrow::SignedField field;
  field.grid.size = {32, 32, 32};
  for (int z = 0; z < 32; ++z)
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x)
        field.values_mm.push_back(float((Eigen::Vector3d(x, y, z) - centre).norm() - kRadius_mm));
  const auto mesh = node_test::call("mesh.new_node", {{"field", node_test::item(field)}}).at("mesh").as<marrow::Mesh>();
  EXPECT_TRUE(marrow::is_closed(mesh));
  EXPECT_NEAR(marrow::enclosed_volume_mm3(mesh), 4188.8, 0.01 * 4188.8);
  for (const auto& vertex : mesh.vertices_mm)
    EXPECT_NEAR((vertex.template cast<double>() - centre).norm(), kRadius_mm, 0.1);
}
