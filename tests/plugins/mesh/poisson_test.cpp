// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::poisson_test {

constexpr const char* kNode = "mesh.poisson";

Mesh poisson(const SignedField& field, const Options& options = {}) {
  return mesh_shapes::meshed(kNode, field, options);
}

TEST(Poisson, ClosesABoneThatIsCutByTheBorder) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 24}),
                                           [](const Vector3d& p) { return p.head<2>().norm() - 9; });
  const Mesh mesh = poisson(field);
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(mesh_shapes::euler_number(mesh), 2);
}

TEST(Poisson, KeepsTheLargestPart) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({64, 64, 52}), [](const Vector3d& p) {
    return std::min(std::abs(p.norm() - 12) - 2, (p - Vector3d(0, 0, 19)).norm() - 3);
  });
  EXPECT_EQ(mesh_shapes::euler_number(poisson(field)), 2);
  EXPECT_EQ(mesh_shapes::euler_number(poisson(field, {{"largest_only", false}})), 6) << "outer wall, inner wall, speck";
}

TEST(Poisson, ADeeperOctreeHasMoreTriangles) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}),
                                           [](const Vector3d& p) { return mesh_shapes::sphere(p, 15); });
  const Mesh coarse = poisson(field, {{"depth", std::int64_t{5}}});
  const Mesh fine = poisson(field, {{"depth", std::int64_t{6}}});
  EXPECT_GT(fine.triangles.size(), 2 * coarse.triangles.size());
}

TEST(Poisson, SeveralAtOnceGiveTheSameBytes) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({40, 40, 32}),
                                           [](const Vector3d& p) { return mesh_shapes::torus(p, 9, 4); });
  const Mesh alone = poisson(field);
  std::array<Mesh, 4> together;
  tbb::parallel_for(0, 4, [&](int i) { together[std::size_t(i)] = poisson(field); });
  for (const Mesh& mesh : together) {
    EXPECT_EQ(mesh.triangles, alone.triangles);
    EXPECT_EQ(mesh.vertices_mm, alone.vertices_mm);
  }
}

TEST(Poisson, NoiseIsClosedOrRefusedInWords) {
  int refused = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    const auto field = mesh_shapes::noise_field({9, 8, 10}, seed, 0.4);
    try {
      EXPECT_TRUE(is_manifold(poisson(field))) << "seed " << seed;
    } catch (const Error& error) {
      ++refused;
      EXPECT_STREQ(error.what(),
                   "field: the surface that fits its points is not closed, as Poisson reconstruction needs a smooth "
                   "surface; smooth the field, "
                   "or use mesh.marching_cubes, which takes every field");
    }
  }
  std::printf("%d of 12 fields of noise refused\n", refused);
}

}  // namespace marrow::test::poisson_test
