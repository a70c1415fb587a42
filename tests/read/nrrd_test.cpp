// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "read/files.hpp"

namespace nrrd_test {

using namespace marrow::test;

class Nrrd : public testing::Test {
 protected:
  marrow::Grid grid_with(const std::string& fields) {
    put(folder / "a.nrrd",
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nencoding: raw\n" + fields + "\n\n" + std::string(60, '\7'));
    return marrow::files::read_volume_file(folder / "a.nrrd", {}).grid;
  }
  TemporaryFolder folder;
};

// The ends of an axis of cells are the borders of its voxels, of nodes their centres.
TEST_F(Nrrd, CentersAreOfEachAxis) {
  const std::string ends = "spacings: 0.5 0.5 1\naxis mins: 0 0 0";
  EXPECT_EQ(grid_with(ends).origin_mm, Eigen::Vector3d(0.25, 0.25, 0.5));
  EXPECT_EQ(grid_with(ends + "\ncenters: node node node").origin_mm, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(grid_with(ends + "\ncenters: cell cell node").origin_mm, Eigen::Vector3d(0.25, 0.25, 0));
  EXPECT_EQ(grid_with(ends + "\naxis maxs: 2 2 3\ncenters: node cell none").origin_mm, Eigen::Vector3d(0, 0.25, 0.5));
  EXPECT_SAYS(grid_with(ends + "\naxis maxs: 2.5 2 3\ncenters: node cell none"), "axis maxs");
  for (const char* wrong : {"node", "node node", "cell cell cell node", "cell cell middle"})
    EXPECT_SAYS(grid_with(ends + "\ncenters: " + wrong), "expected one of cell, node and none for each of the axes");
}

}  // namespace nrrd_test
