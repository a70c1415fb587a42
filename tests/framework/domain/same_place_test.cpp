// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/same_place.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"
#include "tests/harness/message_of.hpp"

namespace same_place_test {

using marrow::Grid;
using marrow::test::message_of;

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
    return message_of([&] { marrow::check_same_grid(field, grid()); });
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
    return message_of([&] { marrow::check_lies_in(mesh, grid(), "the mesh", "the volume"); });
  };
  marrow::Mesh mesh = marrow::test::box({10, 16, 37}, {10.9, 20.9, 61.9});
  EXPECT_EQ(fault(mesh), "") << "up to the voxels' ends";
  EXPECT_EQ(fault(marrow::test::box({10, 16, 67}, {8, 8, 40})), "") << "half of it is cut off";
  EXPECT_EQ(fault(marrow::test::box({10, 16, 537}, {8, 8, 40})),
            "only 0 % of the mesh lies in the volume; give those that belong together");
  mesh.frame = "mr";
  EXPECT_EQ(fault(mesh), "the mesh is in frame 'mr', but the volume in frame 'ct'; give those that belong together");
}

}  // namespace same_place_test
