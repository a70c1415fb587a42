// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"

namespace seeds_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;

marrow::List<marrow::Seeds> seeds_at(const std::filesystem::path& path) {
  return shipped::call("read.seeds", {}, {{"path", path.string()}}).at("seeds").as_list<marrow::Seeds>();
}

TEST(ReadSeeds, FragmentsInTheirOrder) {
  const TemporaryFolder folder;
  put(folder / "s.yaml",
      "marrow-seeds: 1\nfragments:\n  proximal: {seeds: [[1, 2, 3]], register: false}\n  distal:\n    seeds:\n      - "
      "[4, 5, 6]\n      - [7, 8, 9]\n");
  const marrow::List<marrow::Seeds> value = seeds_at(folder / "s.yaml");
  EXPECT_EQ(value.names(), (std::vector<std::string>{"proximal", "distal"}));
  EXPECT_FALSE(value[0].wanted);
  EXPECT_TRUE(value[1].wanted);
  EXPECT_EQ(value[1].points_mm[1], Eigen::Vector3d(7, 8, 9));
}

TEST(ReadSeeds, SeedsOfTheWristLieInBone) {
  const auto file = std::filesystem::path(MARROW_SOURCE_DIR) / "pipelines/wrist/radius.seeds.yaml";
  const marrow::List<marrow::Seeds> radius = seeds_at(file);
  EXPECT_EQ(radius.names(), std::vector<std::string>{"radius"});
  MARROW_NEED_DATA(data, "wrist/volumes/rad_dcm_cropped.tif");
  const marrow::Volume ct = marrow::files::read_volume_file(data, {{0.39625, 0.39625, 0.625}, {}, -1024, ""});
  for (const Eigen::Vector3d& point : radius[0].points_mm)
    EXPECT_GT(sample_trilinear(ct.grid, ct.values, ct.grid.index_from_point(point)), 800);
}

TEST(ReadSeeds, DiagnosesFaults) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& text, const std::string& said) {
    put(folder / "s.yaml", "marrow-seeds: 1\n" + text);
    EXPECT_SAYS(seeds_at(folder / "s.yaml"), said);
  };
  expect("", "key 'fragments' is missing");
  expect("fragments: {}\n", "fragments: expected fragments by name");
  expect("fragments: {a: {seeds: [[1, 2]]}}\n",
         "s.yaml:2:25: fragment 'a': seeds: expected a point [x, y, z] in mm, got a list of 2");
  expect("fragments: {a: {seed: [[1, 2, 3]]}}\n", "unknown key 'seed'; did you mean 'seeds'?");
  expect("fragments: {a: {seeds: [[1, 2, 3]]}, a: {seeds: [[1, 2, 3]]}}\n",
         "s.yaml:2:38: 'a' is given twice in fragments; the first is at line 2");
}

}  // namespace seeds_test
