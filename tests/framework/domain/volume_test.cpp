// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <marrow/domain/volume.hpp>

#include "shapes.hpp"
#include "tests/harness/message_of.hpp"

namespace volume_test {

using Eigen::Vector3d;
using marrow::test::message_of;

/// 4 x 3 x 5 voxels whose value is 1 + 10 x + 100 y + 1000 z of their index.
marrow::Volume ramp() {
  marrow::Volume volume;
  volume.grid.size = {4, 3, 5};
  volume.grid.spacing_mm = {0.5, 2, 1};
  volume.grid.origin_mm = {-7, 11, 100};
  for (int z = 0; z < 5; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 4; ++x) volume.values.push_back(float(1 + 10 * x + 100 * y + 1000 * z));
  return volume;
}

float sample(const Vector3d& index) { return marrow::sample_trilinear(ramp().grid, ramp().values, index); }

TEST(Grid, IndexAndPointAreInverseAndXRunsFastest) {
  marrow::Grid grid = ramp().grid;
  EXPECT_TRUE(grid.point_from_index({0, 0, 0}).isApprox(Vector3d(-7, 11, 100)));
  EXPECT_TRUE(grid.point_from_index({2, 1, 3}).isApprox(Vector3d(-6, 13, 103)));
  grid.direction << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  EXPECT_TRUE(grid.point_from_index({2, 1, 3}).isApprox(Vector3d(-7 + 3, 11 - 1, 100 - 2)));
  EXPECT_TRUE(grid.index_from_point(grid.point_from_index({1.5, 0.25, 3})).isApprox(Vector3d(1.5, 0.25, 3)));
  EXPECT_EQ(ramp().grid.offset(1, 2, 3), 3u * 12 + 2 * 4 + 1);
  EXPECT_EQ(ramp().at(3, 2, 4), 4231);
  EXPECT_TRUE(ramp().grid.contains(3, 2, 4));
  EXPECT_FALSE(ramp().grid.contains(4, 0, 0));
  EXPECT_FALSE(ramp().grid.contains(0, -1, 0));
}

TEST(Trilinear, IsExactOnARampAndClampedToTheBorder) {
  EXPECT_EQ(sample({0, 0, 0}), 1);
  EXPECT_EQ(sample({3, 2, 4}), 4231);
  EXPECT_NEAR(sample({1.5, 0.25, 3.5}), 1 + 15 + 25 + 3500, 1e-3);
  EXPECT_NEAR(sample({2.75, 2, 0.125}), 1 + 27.5 + 200 + 125, 1e-3);
  EXPECT_EQ(sample({-5, -0.1, -100}), 1);
  EXPECT_EQ(sample({3.5, 9, 4.0001}), 4231);
  EXPECT_NEAR(sample({-1, 1.5, 2}), 1 + 150 + 2000, 1e-3);
  marrow::Grid grid;
  grid.size = {2, 2, 1};
  EXPECT_FLOAT_EQ(marrow::sample_trilinear(grid, {0, 1, 2, 3}, {0.5, 0.5, 0}), 1.5f);
  grid.size = {1, 1, 1};
  EXPECT_FLOAT_EQ(marrow::sample_trilinear(grid, {7}, {0.5, -1, 3}), 7);
}

TEST(Volume, CheckNamesTheFault) {
  const auto message = [](auto change) {
    marrow::Volume volume = ramp();
    change(volume);
    return MESSAGE_OF(check_volume(volume, "CT"));
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_EQ(message([](auto& v) { v.grid.size[1] = 0; }), "CT: the volume is empty (size 4 x 0 x 5)");
  EXPECT_EQ(message([](auto& v) { v.grid.spacing_mm[2] = -1; }),
            "CT: voxel spacing -1.000000 mm is not a positive length");
  EXPECT_HAS(message([](auto& v) { v.grid.spacing_mm[0] = std::nan(""); }), "is not a positive length");
  EXPECT_EQ(message([](auto& v) { v.grid.spacing_mm[1] = 0.0009; }),
            "CT: voxel spacing 0.0009 mm; expected 0.001 to 100 mm: is it in another unit?");
  EXPECT_EQ(message([](auto& v) { v.grid.spacing_mm[1] = 101; }),
            "CT: voxel spacing 101 mm; expected 0.001 to 100 mm: is it in another unit?");
  EXPECT_EQ(message([](auto& v) { v.grid.origin_mm[1] = -2e6; }),
            "CT: the volume begins 2e+06 mm from the origin; expected at most 1 km");
  EXPECT_EQ(message([](auto& v) { v.values.pop_back(); }), "CT: 60 voxels expected from its size, got 59");
  EXPECT_HAS(message([](auto& v) { v.grid.direction(0, 0) = 0; }), "CT: not a rotation");
  EXPECT_EQ(message([](auto& v) { v.values[3 * 12 + 2 * 4 + 1] = std::numeric_limits<float>::quiet_NaN(); }),
            "CT: voxel (1, 2, 3) is not a finite number; replace NaN and infinities (with -1000 HU for air)");
}

using marrow::Grid;

Grid grid() {
  Grid grid;
  grid.size = {11, 21, 31};
  grid.spacing_mm = {1, 1, 2};
  grid.origin_mm = {5, 6, 7};
  return grid;
}

TEST(SamePlace, OfTwoGrids) {
  const auto fault = [](const auto& change) {
    Grid field = grid();
    change(field);
    return MESSAGE_OF(marrow::check_same_grid(field, grid()));
  };
  const std::string remedy = "; wire the field that was segmented from this volume";
  EXPECT_EQ(fault([](Grid&) {}), "");
  EXPECT_EQ(fault([](Grid& field) { field.origin_mm.x() += 0.005; }), "") << "files round";
  EXPECT_EQ(fault([](Grid& field) { field.frame = "mr"; }),
            "the field is in frame 'mr', but the volume in frame 'ct'" + remedy);
  EXPECT_EQ(fault([](Grid& field) { field.size[2] = 30; }),
            "the field has another size than the volume: 11 x 21 x 30, not 11 x 21 x 31 voxels" + remedy);
  const std::string apart = "the field is not where the volume is: voxels of the same index are up to ";
  EXPECT_EQ(fault([](Grid& field) { field.origin_mm.z() += 500; }), apart + "500 mm apart" + remedy);
  // The last voxel is 30 steps of 0.1 mm off; turned by half a turn about z, 10 and 20 steps of 1 mm lie across: twice
  // sqrt(100 + 400).
  EXPECT_EQ(fault([](Grid& field) { field.spacing_mm.z() += 0.1; }), apart + "3 mm apart" + remedy);
  EXPECT_EQ(fault([](Grid& field) { field.direction.diagonal() << -1, -1, 1; }), apart + "44.7 mm apart" + remedy);
}

TEST(SamePlace, OfASurfaceInItsGrid) {
  const auto fault = [](marrow::Mesh mesh) {
    return MESSAGE_OF(marrow::check_lies_in(mesh, grid(), "the mesh", "the volume"));
  };
  marrow::Mesh mesh = marrow::test::box({10, 16, 37}, {10.9, 20.9, 61.9});
  EXPECT_EQ(fault(mesh), "") << "up to the voxels' ends";
  EXPECT_EQ(fault(marrow::test::box({10, 16, 67}, {8, 8, 40})), "") << "half of it is cut off";
  EXPECT_EQ(fault(marrow::test::box({10, 16, 537}, {8, 8, 40})),
            "only 0 % of the mesh lies in the volume; give those that belong together");
  mesh.frame = "mr";
  EXPECT_EQ(fault(mesh), "the mesh is in frame 'mr', but the volume in frame 'ct'; give those that belong together");
}

}  // namespace volume_test
