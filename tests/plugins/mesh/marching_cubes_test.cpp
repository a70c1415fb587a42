// SPDX-License-Identifier: Apache-2.0
#include <tbb/global_control.h>
#include <cstring>

#include "marrow/mesh/cells.hpp"
#include "tests/plugins/mesh/shapes.hpp"

namespace marrow::test::marching_cubes_test {

constexpr const char* kNode = "mesh.marching_cubes";

Mesh marching_cubes(const SignedField& field, const Options& options = {}) {
  return mesh_shapes::meshed(kNode, field, options);
}

TEST(CellTable, EveryPatternUsesExactlyTheEdgesThatTheSurfaceCrosses) {
  for (unsigned inside = 0; inside < 256; ++inside) {
    unsigned expected = 0, used = 0;
    for (int edge = 0; edge < 12; ++edge) {
      const int start = surface::kEdgeStart[edge], end = start | 1 << edge / 4;
      if ((inside >> start & 1) != (inside >> end & 1)) expected |= 1u << edge;
    }
    for (const auto& triangle : surface::cell_triangles(inside))
      for (int edge : triangle) used |= 1u << edge;
    EXPECT_EQ(used, expected) << "pattern " << inside;
  }
}

TEST(MarchingCubes, NoiseIsAClosedManifold) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto field = mesh_shapes::noise_field({17, 14, 13}, seed, 0.2 + 0.015 * seed);
    EXPECT_TRUE(is_manifold(marching_cubes(field, {{"largest_only", false}}))) << "seed " << seed;
    EXPECT_TRUE(is_manifold(marching_cubes(field))) << "seed " << seed;
  }
  for (const int width :
       {1, 62, 63, 64, 126, 127, 150})  // rows that end in the middle of a word of signs and at its ends
    EXPECT_TRUE(is_manifold(marching_cubes(mesh_shapes::noise_field({width, 9, 9}, 1), {{"largest_only", false}})))
        << width;
}

TEST(MarchingCubes, AreaOfSphereAndTorus) {
  const auto area_mm2 = [](const mesh_shapes::Distance& distance) {
    return surface_area_mm2(marching_cubes(mesh_shapes::field_of(mesh_shapes::turned_grid({50, 50, 50}), distance)));
  };
  EXPECT_NEAR(area_mm2([](const Vector3d& p) { return mesh_shapes::sphere(p, 15); }) / (4 * kPi * 15 * 15), 1, 2e-3);
  EXPECT_NEAR(area_mm2([](const Vector3d& p) { return mesh_shapes::torus(p, 12, 5); }) / (4 * kPi * kPi * 12 * 5), 1,
              5e-3);
}

TEST(MarchingCubes, Ellipsoid) {
  const mesh_shapes::Distance level =
      [](const Vector3d& p) {  // not a distance: 1 at twice the radius, whatever the axis
        return p.cwiseQuotient(Vector3d(18, 12, 9)).norm() - 1;
      };
  const Mesh mesh = marching_cubes(mesh_shapes::field_of(mesh_shapes::turned_grid({60, 60, 60}), level));
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(mesh_shapes::euler_number(mesh), 2);
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (4.0 / 3 * kPi * 18 * 12 * 9), 1, 4e-3);
  EXPECT_TRUE(mesh_shapes::normals_point_outward(mesh, level));
}

TEST(MarchingCubes, ClosesHalfAVoxelBeyondTheBorder) {
  Grid grid;
  grid.size = {40, 40, 11};
  grid.spacing_mm = {1, 1, 2};
  const auto field =
      mesh_shapes::field_of(grid, [](const Vector3d& p) { return std::hypot(p.x() - 19.7, p.y() - 19.4) - 10; });
  const Mesh mesh = marching_cubes(field);
  EXPECT_TRUE(is_closed(mesh));
  double low = 1e9, high = -1e9;
  for (const auto& v : mesh.vertices_mm) low = std::min(low, v.z()), high = std::max(high, v.z());
  EXPECT_NEAR(low, -1, 1e-9);
  EXPECT_NEAR(high, 21, 1e-9);
  EXPECT_NEAR(enclosed_volume_mm3(mesh) / (kPi * 100 * 22), 1, 8e-3);
}

TEST(MarchingCubes, KeepsTheLargestPartAndDropsItsInnerWall) {
  const mesh_shapes::Distance shell = [](const Vector3d& p) { return std::abs(p.norm() - 12) - 2; };
  const mesh_shapes::Distance both = [&](const Vector3d& p) {
    return std::min(shell(p), (p - Vector3d(0, 0, 19)).norm() - 3);
  };
  const auto field = mesh_shapes::field_of(mesh_shapes::turned_grid({64, 64, 52}), both);
  const Mesh all = marching_cubes(field, {{"largest_only", false}}), largest = marching_cubes(field);
  EXPECT_TRUE(is_closed(all));
  EXPECT_EQ(mesh_shapes::euler_number(all), 6);  // outer wall, inner wall, speck
  EXPECT_EQ(mesh_shapes::euler_number(largest), 2);
  EXPECT_NEAR(enclosed_volume_mm3(largest) / (4.0 / 3 * kPi * 14 * 14 * 14), 1, 3e-3);
}

TEST(MarchingCubes, ZeroesOnGridPointsLeaveNoDegenerateTriangle) {
  SignedField field;
  field.grid.size = {9, 9, 9};
  for (int z = -4; z <= 4; ++z)
    for (int y = -4; y <= 4; ++y)
      for (int x = -4; x <= 4; ++x) field.values_mm.push_back(float(std::abs(x) + std::abs(y) + std::abs(z) - 3));
  const Mesh mesh = marching_cubes(field);
  EXPECT_TRUE(is_closed(mesh));
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices_mm[t[0]], b = mesh.vertices_mm[t[1]], c = mesh.vertices_mm[t[2]];
    EXPECT_GT((b - a).cross(c - a).norm(), 0);
  }
  EXPECT_NEAR(enclosed_volume_mm3(mesh), 4.0 / 3 * 27, 0.02);
}

TEST(MarchingCubes, SmoothingTakesNoiseAndKeepsTheVolume) {
  const mesh_shapes::Distance distance = [](const Vector3d& p) { return mesh_shapes::sphere(p, 15); };
  SignedField field = mesh_shapes::field_of(mesh_shapes::turned_grid({48, 48, 40}), distance);
  const auto noise = mesh_shapes::noise_field(field.grid.size, 3);
  for (std::size_t i = 0; i < noise.values_mm.size(); ++i) field.values_mm[i] += 0.2f * noise.values_mm[i];
  const auto rms_mm = [&](const Mesh& mesh) {
    double sum = 0;
    for (const auto& v : mesh.vertices_mm) sum += distance(v) * distance(v);
    return std::sqrt(sum / double(mesh.vertices_mm.size()));
  };
  const Mesh rough = marching_cubes(field), smooth = marching_cubes(field, {{"smoothing", std::int64_t{10}}});
  EXPECT_LT(rms_mm(smooth), 0.6 * rms_mm(rough));
  EXPECT_NEAR(enclosed_volume_mm3(smooth) / enclosed_volume_mm3(rough), 1, 2e-3);
}

TEST(MarchingCubes, SameBytesAtAnyNumberOfThreads) {
  const auto field = mesh_shapes::noise_field({60, 50, 40}, 5);
  const auto at_threads = [&](std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return marching_cubes(field);
  };
  const Mesh one = at_threads(1), two = at_threads(2);
  ASSERT_EQ(one.triangles, two.triangles);
  ASSERT_EQ(one.vertices_mm.size(), two.vertices_mm.size());
  EXPECT_EQ(std::memcmp(one.vertices_mm.data(), two.vertices_mm.data(), one.vertices_mm.size() * sizeof(Vector3d)), 0);
}

}  // namespace marrow::test::marching_cubes_test
