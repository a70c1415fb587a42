// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace simplify_test {

marrow::Mesh simplify(const marrow::Mesh& mesh, const shipped::Options& options = {}) {
  return shipped::call("mesh.simplify", {{"mesh", shipped::item(mesh)}}, options).at("mesh").as<marrow::Mesh>();
}

TEST(Simplify, KeepsTheShapeOfASphere) {
  const marrow::Mesh sphere = shapes::sphere(25);
  ASSERT_GT(sphere.triangles.size(), 20000u);
  const marrow::Mesh simple = simplify(sphere, {{"triangles", std::int64_t{2000}}});
  EXPECT_LE(simple.triangles.size(), 2000u);
  EXPECT_GT(simple.triangles.size(), 1800u);
  EXPECT_EQ(simple.frame, sphere.frame);
  EXPECT_TRUE(marrow::is_closed(simple));
  for (const Eigen::Vector3d& vertex : simple.vertices_mm)
    EXPECT_NEAR((vertex - Eigen::Vector3d(0, 0, 25)).norm(), 25, 0.1);
  EXPECT_NEAR(marrow::enclosed_volume_mm3(simple), 4.0 / 3 * M_PI * 25 * 25 * 25, 0.01 * 4.0 / 3 * M_PI * 25 * 25 * 25);
}

TEST(Simplify, LeavesASmallMeshAsItIs) {
  const marrow::Mesh box = marrow::test::box({0, 0, 0}, {20, 20, 20});
  const marrow::Mesh same = simplify(box);
  EXPECT_EQ(same.vertices_mm, box.vertices_mm);
  EXPECT_EQ(same.triangles, box.triangles);
}

}  // namespace simplify_test
