// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::simplify_test {

Mesh simplify(const Mesh& mesh, const Options& options = {}) {
  return output<Mesh>("mesh.simplify", "mesh", {{"mesh", item(mesh)}}, options);
}

TEST(Simplify, KeepsTheShapeOfASphere) {
  const Mesh sphere = shapes::sphere(25);
  ASSERT_GT(sphere.triangles.size(), 20000u);
  const Mesh simple = simplify(sphere, {{"triangles", std::int64_t{2000}}});
  EXPECT_LE(simple.triangles.size(), 2000u);
  EXPECT_GT(simple.triangles.size(), 1800u);
  EXPECT_EQ(simple.frame, sphere.frame);
  EXPECT_TRUE(is_closed(simple));
  for (const Vector3d& vertex : simple.vertices_mm) EXPECT_NEAR((vertex - Vector3d(0, 0, 25)).norm(), 25, 0.1);
  EXPECT_NEAR(enclosed_volume_mm3(simple), 4.0 / 3 * M_PI * 25 * 25 * 25, 0.01 * 4.0 / 3 * M_PI * 25 * 25 * 25);
}

TEST(Simplify, LeavesASmallMeshAsItIs) {
  const Mesh box = test::box({0, 0, 0}, {20, 20, 20});
  const Mesh same = simplify(box);
  EXPECT_EQ(same.vertices_mm, box.vertices_mm);
  EXPECT_EQ(same.triangles, box.triangles);
}

}  // namespace marrow::test::simplify_test
