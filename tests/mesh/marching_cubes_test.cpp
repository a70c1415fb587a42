// SPDX-License-Identifier: Apache-2.0
#include "plugins/mesh/marching_cubes.cpp"

#include <tbb/global_control.h>

#include <chrono>
#include <cstring>

#include "mesh/shapes.hpp"

namespace {

using Eigen::Vector3d;
using marrow::kPi;

TEST(CellTable, EveryPatternUsesExactlyTheEdgesThatTheSurfaceCrosses) {
  for (unsigned inside = 0; inside < 256; ++inside) {
    unsigned expected = 0, used = 0;
    for (int edge = 0; edge < 12; ++edge) {
      const int start = marching_cubes::kEdgeStart[edge], end = start | 1 << edge / 4;
      if ((inside >> start & 1) != (inside >> end & 1)) expected |= 1u << edge;
    }
    for (const auto& triangle : marching_cubes::cell_triangles(inside))
      for (int edge : triangle) used |= 1u << edge;
    EXPECT_EQ(used, expected) << "pattern " << inside;
  }
}

TEST(CellTable, APatternAloneInTheGridIsAClosedSurface) {
  for (unsigned inside = 1; inside < 256; ++inside) {
    SignedField field;
    field.grid.size = {2, 2, 2};
    for (int corner = 0; corner < 8; ++corner) field.values_mm.push_back(inside >> corner & 1 ? -1.f : 0.6f);
    if (inside == 255) continue;
    const Mesh mesh = triangulate(field);
    EXPECT_TRUE(marrow::is_closed(mesh)) << "pattern " << inside;
    EXPECT_GT(marrow::enclosed_volume_mm3(mesh), 0) << "pattern " << inside;
  }
}

TEST(MarchingCubes, NoiseIsClosedAndOriented) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto field = shapes::noise_field({17, 14, 13}, seed);
    const Mesh mesh = marching_cubes_mesh(field, {.largest_only = false});
    EXPECT_TRUE(marrow::is_closed(mesh)) << "seed " << seed;
    EXPECT_TRUE(marrow::is_closed(marching_cubes_mesh(field, {}))) << "seed " << seed;
  }
  EXPECT_TRUE(marrow::is_closed(marching_cubes_mesh(shapes::noise_field({150, 9, 9}, 1), {.largest_only = false})));
}

TEST(MarchingCubes, SphereInATurnedGrid) {
  const shapes::Distance distance = [](const Vector3d& p) { return shapes::sphere(p, 15); };
  const Mesh mesh = marching_cubes_mesh(shapes::field_of(shapes::turned_grid({48, 48, 40}), distance), {});
  EXPECT_EQ(mesh.frame, "scanner");
  EXPECT_TRUE(marrow::is_closed(mesh));
  EXPECT_EQ(shapes::euler_number(mesh), 2);
  EXPECT_LT(shapes::largest_error_mm(mesh, distance), 0.012);
  EXPECT_NEAR(marrow::surface_area_mm2(mesh) / (4 * kPi * 15 * 15), 1, 2e-3);
  EXPECT_NEAR(marrow::enclosed_volume_mm3(mesh) / (4.0 / 3 * kPi * 15 * 15 * 15), 1, 3e-3);
  EXPECT_TRUE(shapes::normals_point_outward(mesh, distance));
}

TEST(MarchingCubes, Ellipsoid) {
  const shapes::Distance level = [](const Vector3d& p) {  // not a distance: 1 at twice the radius, whatever the axis
    return p.cwiseQuotient(Vector3d(18, 12, 9)).norm() - 1;
  };
  const Mesh mesh = marching_cubes_mesh(shapes::field_of(shapes::turned_grid({60, 60, 60}), level), {});
  EXPECT_TRUE(marrow::is_closed(mesh));
  EXPECT_EQ(shapes::euler_number(mesh), 2);
  EXPECT_NEAR(marrow::enclosed_volume_mm3(mesh) / (4.0 / 3 * kPi * 18 * 12 * 9), 1, 4e-3);
  EXPECT_TRUE(shapes::normals_point_outward(mesh, level));
}

TEST(MarchingCubes, Torus) {
  const shapes::Distance distance = [](const Vector3d& p) { return shapes::torus(p, 12, 5); };
  const Mesh mesh = marching_cubes_mesh(shapes::field_of(shapes::turned_grid({50, 50, 50}), distance), {});
  EXPECT_TRUE(marrow::is_closed(mesh));
  EXPECT_EQ(shapes::euler_number(mesh), 0);
  EXPECT_NEAR(marrow::enclosed_volume_mm3(mesh) / (2 * kPi * kPi * 12 * 25), 1, 1e-2);
  EXPECT_NEAR(marrow::surface_area_mm2(mesh) / (4 * kPi * kPi * 12 * 5), 1, 5e-3);
}

TEST(MarchingCubes, ClosesHalfAVoxelBeyondTheBorder) {
  Grid grid;
  grid.size = {40, 40, 11};
  grid.spacing_mm = {1, 1, 2};
  const auto field =
      shapes::field_of(grid, [](const Vector3d& p) { return std::hypot(p.x() - 19.7, p.y() - 19.4) - 10; });
  const Mesh mesh = marching_cubes_mesh(field, {});
  EXPECT_TRUE(marrow::is_closed(mesh));
  double low = 1e9, high = -1e9;
  for (const auto& v : mesh.vertices_mm) low = std::min(low, v.z()), high = std::max(high, v.z());
  EXPECT_NEAR(low, -1, 1e-9);
  EXPECT_NEAR(high, 21, 1e-9);
  EXPECT_NEAR(marrow::enclosed_volume_mm3(mesh) / (kPi * 100 * 22), 1, 8e-3);
}

TEST(MarchingCubes, KeepsTheLargestPartAndDropsItsInnerWall) {
  const shapes::Distance shell = [](const Vector3d& p) { return std::abs(p.norm() - 12) - 2; };
  const shapes::Distance both = [&](const Vector3d& p) {
    return std::min(shell(p), (p - Vector3d(0, 0, 19)).norm() - 3);
  };
  const auto field = shapes::field_of(shapes::turned_grid({64, 64, 52}), both);
  const Mesh all = marching_cubes_mesh(field, {.largest_only = false}), largest = marching_cubes_mesh(field, {});
  EXPECT_TRUE(marrow::is_closed(all));
  EXPECT_EQ(shapes::euler_number(all), 6);  // outer wall, inner wall, speck
  EXPECT_EQ(shapes::euler_number(largest), 2);
  EXPECT_NEAR(marrow::enclosed_volume_mm3(largest) / (4.0 / 3 * kPi * 14 * 14 * 14), 1, 3e-3);
}

TEST(MarchingCubes, ZeroesOnGridPointsLeaveNoDegenerateTriangle) {
  SignedField field;
  field.grid.size = {9, 9, 9};
  for (int z = -4; z <= 4; ++z)
    for (int y = -4; y <= 4; ++y)
      for (int x = -4; x <= 4; ++x) field.values_mm.push_back(float(std::abs(x) + std::abs(y) + std::abs(z) - 3));
  const Mesh mesh = marching_cubes_mesh(field, {});
  EXPECT_TRUE(marrow::is_closed(mesh));
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices_mm[t[0]], b = mesh.vertices_mm[t[1]], c = mesh.vertices_mm[t[2]];
    EXPECT_GT((b - a).cross(c - a).norm(), 0);
  }
  EXPECT_NEAR(marrow::enclosed_volume_mm3(mesh), 4.0 / 3 * 27, 0.02);
}

TEST(MarchingCubes, SmoothingTakesNoiseAndKeepsTheVolume) {
  const shapes::Distance distance = [](const Vector3d& p) { return shapes::sphere(p, 15); };
  SignedField field = shapes::field_of(shapes::turned_grid({48, 48, 40}), distance);
  const auto noise = shapes::noise_field(field.grid.size, 3);
  for (std::size_t i = 0; i < noise.values_mm.size(); ++i) field.values_mm[i] += 0.2f * noise.values_mm[i];
  const auto rms_mm = [&](const Mesh& mesh) {
    double sum = 0;
    for (const auto& v : mesh.vertices_mm) sum += distance(v) * distance(v);
    return std::sqrt(sum / double(mesh.vertices_mm.size()));
  };
  const Mesh rough = marching_cubes_mesh(field, {}), smooth = marching_cubes_mesh(field, {.smoothing = 10});
  EXPECT_LT(rms_mm(smooth), 0.6 * rms_mm(rough));
  EXPECT_NEAR(marrow::enclosed_volume_mm3(smooth) / marrow::enclosed_volume_mm3(rough), 1, 2e-3);
}

TEST(MarchingCubes, SameBytesAtAnyNumberOfThreads) {
  const auto field = shapes::noise_field({60, 50, 40}, 5);
  const auto at_threads = [&](std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return marching_cubes_mesh(field, {});
  };
  const Mesh one = at_threads(1), two = at_threads(2);
  ASSERT_EQ(one.triangles, two.triangles);
  ASSERT_EQ(one.vertices_mm.size(), two.vertices_mm.size());
  EXPECT_EQ(std::memcmp(one.vertices_mm.data(), two.vertices_mm.data(), one.vertices_mm.size() * sizeof(Vector3d)), 0);
}

TEST(MarchingCubes, TellsTimeOnAWholeBone) {
  Grid grid;
  grid.size = {256, 256, 384};
  const auto field = shapes::field_of(
      grid, [](const Vector3d& p) { return std::hypot(p.x() - 128, p.y() - 128) - 60 + 8 * std::sin(p.z() / 20); });
  const auto start = std::chrono::steady_clock::now();
  const Mesh mesh = marching_cubes_mesh(field, {});
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  std::printf("256x256x384: %zu triangles in %.0f ms\n", mesh.triangles.size(), ms);
  RecordProperty("milliseconds", int(ms));
  EXPECT_TRUE(marrow::is_closed(mesh));
}

std::string message_of(const SignedField& field) {
  try {
    marching_cubes_mesh(field, {});
  } catch (const marrow::Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(MarchingCubes, SaysWhatIsWrongWithAField) {
  EXPECT_EQ(message_of({}),
            "field: 0 values do not fill a grid of 0 x 0 x 0 voxels; wire the output of a segment node");
  SignedField field;
  field.grid.size = {3, 3, 3};
  field.values_mm.assign(27, 2.f);
  EXPECT_EQ(message_of(field),
            "field: there is no surface, as no value is negative (inside); the segmentation found "
            "nothing: check its seeds and thresholds");
  field.values_mm.assign(27, -2.f);
  EXPECT_EQ(message_of(field),
            "field: there is no surface, as every value is negative (inside); the segmentation ran over "
            "the whole volume: raise its threshold");
  field.values_mm[13] = std::nanf("");
  EXPECT_EQ(message_of(field), "field: some values are not finite numbers; a signed distance in mm was expected");
}

}  // namespace
