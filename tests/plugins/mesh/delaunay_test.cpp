// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::delaunay_test {

using namespace mesh_shapes;

Mesh mesh_of(const SignedField& field, const Options& options = {}) { return meshed("mesh.delaunay", field, options); }

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

/// Several meshes at once are the same as one alone.
template <class Mesher>
void expect_same_bytes(const Mesher& mesher) {
  const auto field = field_by(turned_grid({40, 40, 32}), [](const Vector3d& p) { return torus(p, 9, 4); });
  const Mesh alone = mesher(field, {});
  std::array<Mesh, 6> together;
  tbb::parallel_for(0, 6, [&](int i) { together[std::size_t(i)] = mesher(field, {}); });
  for (const Mesh& mesh : together) {
    EXPECT_EQ(mesh.triangles, alone.triangles);
    EXPECT_EQ(mesh.vertices_mm, alone.vertices_mm);
  }
}

/// Noise gives a closed surface, or a refusal that begins like this.
template <class Mesher>
void expect_closed_or_refused(const Mesher& mesher, const std::string& words) {
  int refused = 0;
  for (unsigned seed = 0; seed < 12; ++seed) try {
      EXPECT_TRUE(is_manifold(mesher(noise_field({9, 8, 10}, seed, 0.4), {}))) << "seed " << seed;
    } catch (const Error& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).rfind(words, 0), 0u) << error.what();
    }
  std::printf("%d of 12 fields of noise refused\n", refused);
}

TEST(Delaunay, NoAngleIsSmallerThanAskedFor) {
  const auto field = sphere_field();
  EXPECT_GT(smallest_angle_deg(mesh_of(field)), 29.9);
}

TEST(Delaunay, TrianglesAreAsSmallAsAskedFor) {
  const auto field = sphere_field();
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
  const auto field = field_by(turned_grid({48, 48, 40}), [](const Vector3d& p) { return two_slabs(p, 1.5); });
  EXPECT_EQ(euler_number(mesh_of(field, {{"largest_only", false}})), 4);
}

TEST(Delaunay, FindsPartsMuchSmallerThanItsTriangles) {
  for (unsigned inside = 1; inside < 256; ++inside) {
    const Mesh mesh = mesh_of(pattern_field(inside, false), {{"largest_only", false}});
    EXPECT_TRUE(is_manifold(mesh)) << "pattern " << inside;
    EXPECT_GT(enclosed_volume_mm3(mesh), 0);
  }
}

/// CGAL orders cells by their addresses. Several meshers at once place them differently in memory than one alone.
TEST(Delaunay, SameBytesWhereverItsMemoryLies) { expect_same_bytes(mesh_of); }

TEST(Delaunay, NoiseIsClosedOrRefusedInWords) {
  expect_closed_or_refused(mesh_of, "field: Delaunay refinement does not close its surface: ");
}

TEST(Delaunay, CanBeCancelled) {
  std::atomic<bool> cancelled = true;
  Context::Hooks hooks;
  hooks.cancelled = &cancelled;
  const auto field = sphere_field();
  EXPECT_THROW(call("mesh.delaunay", {{"field", item(field)}}, {}, Context(hooks)), Cancelled);
}

Mesh poisson(const SignedField& field, const Options& options = {}) { return meshed("mesh.poisson", field, options); }

TEST(Poisson, ClosesABoneThatIsCutByTheBorder) {
  const auto field = field_by(turned_grid({48, 48, 24}), [](const Vector3d& p) { return p.head<2>().norm() - 9; });
  const Mesh mesh = poisson(field);
  EXPECT_TRUE(is_manifold(mesh));
  EXPECT_EQ(euler_number(mesh), 2);
}

TEST(Poisson, KeepsTheLargestPart) {
  const auto field = shell_and_speck();
  EXPECT_EQ(euler_number(poisson(field)), 2);
  EXPECT_EQ(euler_number(poisson(field, {{"largest_only", false}})), 6) << "outer wall, inner wall, speck";
}

TEST(Poisson, ADeeperOctreeHasMoreTriangles) {
  const auto field = sphere_field();
  const Mesh coarse = poisson(field, {{"depth", 5}});
  const Mesh fine = poisson(field, {{"depth", 6}});
  EXPECT_GT(fine.triangles.size(), 2 * coarse.triangles.size());
}

TEST(Poisson, SeveralAtOnceGiveTheSameBytes) { expect_same_bytes(poisson); }

TEST(Poisson, NoiseIsClosedOrRefusedInWords) {
  expect_closed_or_refused(poisson,
                           "field: the surface that fits its points is not closed, as Poisson reconstruction needs a "
                           "smooth surface; smooth the field, or use mesh.marching_cubes, which takes every field");
}

}  // namespace marrow::test::delaunay_test
