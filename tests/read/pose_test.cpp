// SPDX-License-Identifier: Apache-2.0
#include "plugins/read/pose.cpp"

#include <gtest/gtest.h>

#include "read/files.hpp"

namespace {

using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;

const std::string kPose = R"(marrow-pose: 1
target: world
source: ct
rotation: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
translation_mm: [1, -2.5, 3e2]
)";

TEST(ReadPose, RotationAndTranslation) {
  const TemporaryFolder folder;
  put(folder / "p.yaml", kPose);
  const marrow::Pose value = pose({folder / "p.yaml"});
  EXPECT_EQ(value.world_from_model.target, "world");
  EXPECT_EQ(value.world_from_model.source, "ct");
  EXPECT_EQ(value.world_from_model * Eigen::Vector3d(10, 0, 0), Eigen::Vector3d(1, 7.5, 300));
  EXPECT_FALSE(value.covariance);
}

// The shipped placements of the real radius agree with the affine matrices that they were made from, which count voxels
// from their corners.
TEST(ReadPose, PlacementsOfTheWrist) {
  MARROW_NEED_DATA(data, "wrist/start.json");
  const YAML::Node starts = YAML::LoadFile(data)["radius"];
  for (const char* frame : {"0002", "0158"}) {
    const marrow::Pose value = pose({std::filesystem::path(MARROW_SOURCE_DIR) / "pipelines/wrist" /
                                     ("radius-" + std::string(frame) + ".pose.yaml")});
    const auto rows = starts[frame]["index_to_world_3x4"].as<std::vector<std::vector<double>>>();
    for (const Eigen::Vector3d& index :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(67, 85, 0), Eigen::Vector3d(30, 40, 127)}) {
      const Eigen::Vector3d world =
          value.world_from_model * index.cwiseProduct(Eigen::Vector3d(0.39625, 0.39625, 0.625));
      for (int r = 0; r < 3; ++r) {
        const double expected =
            rows[r][0] * (index[0] + 0.5) + rows[r][1] * (index[1] + 0.5) + rows[r][2] * (index[2] + 0.5) + rows[r][3];
        EXPECT_NEAR(world[r], expected, 0.02) << frame;
      }
    }
  }
}

TEST(ReadPose, DiagnosesFaults) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& text, const std::string& said) {
    put(folder / "p.yaml", text);
    EXPECT_SAYS(pose({folder / "p.yaml"}), said);
  };
  expect(with(kPose, "[1, 0, 0]", "[1, 0]"), "p.yaml:4:11: pose: rotation: expected 3 rows of 3 numbers");
  expect(with(kPose, "[1, 0, 0]", "[-1, 0, 0]"), "not a rotation (off orthonormal by 0");
  expect(with(kPose, "source: ct", "source: world"), "p.yaml:3:9: pose: source: expected the frame 'ct', got 'world'");
  expect(with(kPose, "translation_mm", "translation"), "unknown key 'translation'; did you mean 'translation_mm'?");
  expect(with(kPose, "marrow-pose: 1\n", ""), "key 'marrow-pose' is missing");
  expect(kPose + "covariance: [[1]]\n", "covariance: expected 6 rows of 6 numbers");
  expect("- a\n", "expected a YAML map of keys and values, got a list of 1");
  expect("", "expected a YAML map of keys and values, got nothing");
  expect(kPose + "---\n" + kPose, "expected one YAML document, got more");
}

}  // namespace
