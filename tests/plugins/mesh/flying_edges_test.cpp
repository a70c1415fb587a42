// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::flying_edges_test {

constexpr const char* kNode = "mesh.flying_edges";

Mesh flying_edges(const SignedField& field, const Options& options = {}) {
  return mesh_shapes::meshed(kNode, field, options);
}

TEST(FlyingEdges, ClosesHalfAVoxelBeyondTheBorder) {
  Grid grid;
  grid.size = {40, 40, 11};
  grid.spacing_mm = {1, 1, 2};
  const Mesh mesh = flying_edges(
      mesh_shapes::field_of(grid, [](const Vector3d& p) { return std::hypot(p.x() - 19.7, p.y() - 19.4) - 10; }));
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (kPi * 100 * 22), 1, 8e-3);
}

TEST(FlyingEdges, KeepsTheLargestPart) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({64, 64, 52}), [](const Vector3d& p) {
    return std::min(std::abs(p.norm() - 12) - 2, (p - Vector3d(0, 0, 19)).norm() - 3);
  });
  const Mesh largest = flying_edges(field);
  EXPECT_EQ(mesh_shapes::euler_number(largest), 2);
  EXPECT_NEAR(enclosed_volume_mm3(largest) / (4.0 / 3 * kPi * 14 * 14 * 14), 1, 3e-3);
}

}  // namespace marrow::test::flying_edges_test
