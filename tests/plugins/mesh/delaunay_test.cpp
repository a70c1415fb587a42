// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>
#include <atomic>

#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::delaunay_test {

constexpr const char* kNode = "mesh.delaunay";

Mesh mesh_of(const SignedField& field, const Options& options = {}) {
  return mesh_shapes::meshed(kNode, field, options);
}

/// Smallest angle of a mesh's triangles.
double smallest_angle_deg(const Mesh& mesh) {
  double smallest = 180;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vector3d at = mesh.vertices_mm[t[k]], a = mesh.vertices_mm[t[(k + 1) % 3]] - at,
                     b = mesh.vertices_mm[t[(k + 2) % 3]] - at;
      smallest = std::min(smallest, std::acos(a.normalized().dot(b.normalized())) * 180 / kPi);
    }
  return smallest;
}

TEST(Delaunay, NoAngleIsSmallerThanAskedFor) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}),
                                           [](const Vector3d& p) { return mesh_shapes::sphere(p, 15); });
  EXPECT_GT(smallest_angle_deg(mesh_of(field)), 29.9);
}

TEST(Delaunay, TrianglesAreAsSmallAsAskedFor) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}),
                                           [](const Vector3d& p) { return mesh_shapes::sphere(p, 15); });
  std::size_t fewer = 0;
  for (const double size_mm : {4.0, 2.0, 1.0}) {
    const Mesh mesh = mesh_of(field, {{"max_radius_mm", size_mm}, {"max_distance_mm", size_mm}});
    EXPECT_GT(double(mesh.triangles.size()), 1.5 * double(fewer));
    fewer = mesh.triangles.size();
    for (const auto& t : mesh.triangles)
      EXPECT_LE((mesh.vertices_mm[t[0]] - mesh.vertices_mm[t[1]]).norm(), 2 * size_mm + 1e-6);
  }
}

TEST(Delaunay, KeepsApartWhatOneSampleParts) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}),
                                           [](const Vector3d& p) { return mesh_shapes::two_slabs(p, 1.5); });
  EXPECT_EQ(mesh_shapes::euler_number(mesh_of(field, {{"largest_only", false}})), 4);
}

TEST(Delaunay, FindsPartsMuchSmallerThanItsTriangles) {
  for (unsigned inside = 1; inside < 256; ++inside) {
    const Mesh mesh = mesh_of(mesh_shapes::pattern_field(inside, false), {{"largest_only", false}});
    EXPECT_TRUE(is_manifold(mesh)) << "pattern " << inside;
    EXPECT_GT(enclosed_volume_mm3(mesh), 0);
  }
}

/// CGAL orders cells by their addresses. Several meshers at once place them differently in memory than one alone.
TEST(Delaunay, SameBytesWhereverItsMemoryLies) {
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({40, 40, 32}),
                                           [](const Vector3d& p) { return mesh_shapes::torus(p, 9, 4); });
  const Mesh alone = mesh_of(field);
  std::array<Mesh, 6> together;
  tbb::parallel_for(0, 6, [&](int i) { together[std::size_t(i)] = mesh_of(field); });
  for (const Mesh& mesh : together) {
    EXPECT_EQ(mesh.triangles, alone.triangles);
    EXPECT_EQ(mesh.vertices_mm, alone.vertices_mm);
  }
}

TEST(Delaunay, NoiseIsClosedOrRefusedInWords) {
  int refused = 0;
  for (unsigned seed = 0; seed < 12; ++seed) try {
      EXPECT_TRUE(is_manifold(mesh_of(mesh_shapes::noise_field({9, 8, 10}, seed, 0.4)))) << "seed " << seed;
    } catch (const Error& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).rfind("field: Delaunay refinement does not close its surface: ", 0), 0u)
          << error.what();
    }
  std::printf("%d of 12 fields of noise refused\n", refused);
}

TEST(Delaunay, CanBeCancelled) {
  std::atomic<bool> cancelled = true;
  Context::Hooks hooks;
  hooks.cancelled = &cancelled;
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}),
                                           [](const Vector3d& p) { return mesh_shapes::sphere(p, 15); });
  EXPECT_THROW(call(kNode, {{"field", item(field)}}, {}, Context(hooks)), Cancelled);
}

}  // namespace marrow::test::delaunay_test
