// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <marrow/domain/volume.hpp>

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

TEST(Grid, IndexAndPointAreInverse) {
  marrow::Grid grid = ramp().grid;
  EXPECT_TRUE(grid.point_from_index({0, 0, 0}).isApprox(Vector3d(-7, 11, 100)));
  EXPECT_TRUE(grid.point_from_index({2, 1, 3}).isApprox(Vector3d(-6, 13, 103)));
  grid.direction << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  EXPECT_TRUE(grid.point_from_index({2, 1, 3}).isApprox(Vector3d(-7 + 3, 11 - 1, 100 - 2)));
  EXPECT_TRUE(grid.index_from_point(grid.point_from_index({1.5, 0.25, 3})).isApprox(Vector3d(1.5, 0.25, 3)));
}

TEST(Grid, XRunsFastest) {
  EXPECT_EQ(ramp().grid.offset(1, 2, 3), 3u * 12 + 2 * 4 + 1);
  EXPECT_EQ(ramp().at(3, 2, 4), 4231);
  EXPECT_TRUE(ramp().grid.contains(3, 2, 4));
  EXPECT_FALSE(ramp().grid.contains(4, 0, 0));
  EXPECT_FALSE(ramp().grid.contains(0, -1, 0));
}

TEST(Trilinear, IsExactOnARamp) {
  EXPECT_EQ(sample({0, 0, 0}), 1);
  EXPECT_EQ(sample({3, 2, 4}), 4231);
  EXPECT_NEAR(sample({1.5, 0.25, 3.5}), 1 + 15 + 25 + 3500, 1e-3);
  EXPECT_NEAR(sample({2.75, 2, 0.125}), 1 + 27.5 + 200 + 125, 1e-3);
}

TEST(Trilinear, IsClampedToTheBorder) {
  EXPECT_EQ(sample({-5, -0.1, -100}), 1);
  EXPECT_EQ(sample({3.5, 9, 4.0001}), 4231);
  EXPECT_NEAR(sample({-1, 1.5, 2}), 1 + 150 + 2000, 1e-3);
}

TEST(Trilinear, WorksOnASingleSlice) {
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
    return message_of([&] { check_volume(volume, "CT"); });
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_EQ(message([](auto& v) { v.grid.size[1] = 0; }), "CT: the volume is empty (size 4 x 0 x 5)");
  EXPECT_EQ(message([](auto& v) { v.grid.spacing_mm[2] = -1; }),
            "CT: voxel spacing -1.000000 mm is not a positive length");
  EXPECT_NE(message([](auto& v) { v.grid.spacing_mm[0] = std::nan(""); }).find("is not a positive length"),
            std::string::npos);
  EXPECT_EQ(message([](auto& v) { v.grid.spacing_mm[1] = 0.0009; }),
            "CT: voxel spacing 0.0009 mm; expected 0.001 to 100 mm: is it in another unit?");
  EXPECT_EQ(message([](auto& v) { v.grid.spacing_mm[1] = 101; }),
            "CT: voxel spacing 101 mm; expected 0.001 to 100 mm: is it in another unit?");
  EXPECT_EQ(message([](auto& v) { v.grid.origin_mm[1] = -2e6; }),
            "CT: the volume begins 2e+06 mm from the origin; expected at most 1 km");
  EXPECT_EQ(message([](auto& v) { v.values.pop_back(); }), "CT: 60 voxels expected from its size, got 59");
  EXPECT_NE(message([](auto& v) { v.grid.direction(0, 0) = 0; }).find("CT: not a rotation"), std::string::npos);
  EXPECT_EQ(message([](auto& v) { v.values[3 * 12 + 2 * 4 + 1] = std::numeric_limits<float>::quiet_NaN(); }),
            "CT: voxel (1, 2, 3) is not a finite number; replace NaN and infinities (with -1000 HU for air)");
}

}  // namespace volume_test
