// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/files.hpp"

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

// The first file is what ITK writes for an image of vectors with one component; a value axis of one sample changes
// nothing in the order of the samples.
TEST_F(Nrrd, AxesOfOneValueAreNoneOfTheVolume) {
  std::string samples;
  for (char i = 0; i < 60; ++i) samples += i;
  const auto volume_with = [&](const std::string& fields) {
    put(folder / "b.nrrd", "NRRD0004\ntype: uchar\nencoding: raw\n" + fields + "\n\n" + samples);
    return marrow::files::read_volume_file(folder / "b.nrrd", {});
  };
  const std::string space =
      "\nspace: left-posterior-superior\nspace origin: (1,2,3)\nspace directions: none (0.5,0,0) (0,2,0) (0,0,3)";
  for (const std::string& fields :
       {"dimension: 4\nsizes: 1 5 4 3\nkinds: vector domain domain domain" + space,
        "dimension: 4\nsizes: 1 5 4 3\nkinds: list domain domain domain\nunits: \"\" \"mm\" \"mm\" \"mm\"" + space,
        "dimension: 4\nsizes: 1 5 4 3" + space, "dimension: 5\nsizes: 1 5 4 3 1" + space + " none",
        std::string("dimension: 4\nsizes: 5 4 3 1\nspacings: 0.5 2 3 nan\naxis mins: 0.75 1 1.5 nan")}) {
    const marrow::Volume volume = volume_with(fields);
    EXPECT_EQ(volume.grid.size, (std::array<int, 3>{5, 4, 3})) << fields;
    EXPECT_EQ(volume.grid.spacing_mm, Eigen::Vector3d(0.5, 2, 3)) << fields;
    EXPECT_EQ(volume.grid.origin_mm, Eigen::Vector3d(1, 2, 3)) << fields;
    EXPECT_EQ(volume.at(4, 1, 2), 49) << fields;
  }
  EXPECT_SAYS(volume_with("dimension: 4\nsizes: 3 5 4 1\nkinds: vector domain domain domain" + space),
              "has 3 values per voxel; a CT has one");
  EXPECT_SAYS(volume_with("dimension: 4\nsizes: 5 4 1 3\nspacings: 1 1 1 1"), "has 4 dimensions; expected one volume");
}

}  // namespace nrrd_test
