// SPDX-License-Identifier: Apache-2.0
#include <tbb/global_control.h>

#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::surface_nets_test {

constexpr const char* kNode = "mesh.surface_nets";

Mesh nets(const SignedField& field, bool largest_only = true, int relaxation = 0) {
  return mesh_shapes::meshed(kNode, field, {{"largest_only", largest_only}, {"relaxation", std::int64_t{relaxation}}});
}

TEST(SurfaceNets, NoiseIsAClosedManifold) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto field = mesh_shapes::noise_field({17, 14, 13}, seed, 0.2 + 0.015 * seed);
    EXPECT_TRUE(is_manifold(nets(field, false))) << "seed " << seed;
    EXPECT_TRUE(is_manifold(nets(field, false, 3))) << "seed " << seed;
  }
}

/// Two samples are outside, on the diagonal of a face; all others are inside. Both cells at the face have one loop,
/// which crosses the face twice.
TEST(SurfaceNets, AFaceThatIsCrossedTwiceByTheSameTwoLoopsIsSplit) {
  SignedField field;
  field.grid.size = {5, 5, 5};
  field.values_mm.assign(125, -1);
  field.values_mm[field.grid.offset(2, 2, 2)] = field.values_mm[field.grid.offset(3, 3, 2)] = 1;
  const Mesh mesh = nets(field, false);
  EXPECT_TRUE(is_manifold(mesh));
  int split = 0;
  for (const auto& v : mesh.vertices_mm) split += (v - Vector3d(2.5, 2.5, 2)).head<2>().norm() < 0.4 && v.z() == 2;
  EXPECT_EQ(split, 2) << "one vertex for each crossing of the face";
}

TEST(SurfaceNets, KeepsApartWhatOneSampleParts) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}),
                                           [](const Vector3d& p) { return mesh_shapes::two_slabs(p, 1.5); });
  EXPECT_EQ(mesh_shapes::euler_number(nets(field, false)), 4);
}

/// A field of signs alone has steps as high as a sample.
TEST(SurfaceNets, RelaxationTakesTheStepsOfABinaryField) {
  const mesh_shapes::Distance distance = [](const Vector3d& p) { return mesh_shapes::sphere(p, 22); };
  SignedField field = mesh_shapes::field_of(mesh_shapes::turned_grid({62, 62, 50}), distance);
  for (float& value : field.values_mm) value = value < 0 ? -0.5f : 0.5f;
  const auto roughness = [&](const Mesh& mesh) {  // sine between the triangles' normals and the sphere's
    double sum = 0;
    for (const auto& t : mesh.triangles) {
      const Vector3d a = mesh.vertices_mm[t[0]], b = mesh.vertices_mm[t[1]], c = mesh.vertices_mm[t[2]];
      sum += (b - a).cross(c - a).normalized().cross((a + b + c).normalized()).squaredNorm();
    }
    return std::sqrt(sum / double(mesh.triangles.size()));
  };
  const Mesh rough = nets(field), relaxed = nets(field, true, 5);
  EXPECT_LT(roughness(relaxed), 0.5 * roughness(rough));
  EXPECT_TRUE(is_manifold(relaxed));
  EXPECT_NEAR(enclosed_volume_mm3(relaxed) / (4.0 / 3 * kPi * 22 * 22 * 22), 1, 0.02);
  const Mesh long_relaxed = nets(field, true, 100);
  ASSERT_EQ(long_relaxed.vertices_mm.size(), rough.vertices_mm.size());
  for (std::size_t v = 0; v < rough.vertices_mm.size(); ++v) {  // both lie in the same cell, a sample wide
    const Vector3d moved =
        field.grid.index_from_point(long_relaxed.vertices_mm[v]) - field.grid.index_from_point(rough.vertices_mm[v]);
    EXPECT_LE(moved.cwiseAbs().maxCoeff(), 1 + 1e-9);
  }
}

TEST(SurfaceNets, SameBytesAtAnyNumberOfThreads) {
  const auto field = mesh_shapes::noise_field({60, 50, 40}, 5);
  const auto at_threads = [&](std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return nets(field, true, 2);
  };
  const Mesh one = at_threads(1), two = at_threads(2);
  EXPECT_EQ(one.triangles, two.triangles);
  EXPECT_EQ(one.vertices_mm, two.vertices_mm);
}

}  // namespace marrow::test::surface_nets_test
