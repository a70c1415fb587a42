// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "marrow/toolbox/files/yaml_text.hpp"
#include "read/files.hpp"
#include "read/reading.hpp"

namespace pose_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;

marrow::Pose pose_at(const std::filesystem::path& path) {
  return marrow::test::read_by<marrow::Pose>("read.pose", path);
}

const std::string kPose = R"(marrow-pose: 1
target: world
source: ct
rotation: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
translation_mm: [1, -2.5, 3e2]
)";

TEST(ReadPose, RotationAndTranslation) {
  const TemporaryFolder folder;
  put(folder / "p.yaml", kPose);
  const marrow::Pose value = pose_at(folder / "p.yaml");
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
    const marrow::Pose value = pose_at(std::filesystem::path(MARROW_SOURCE_DIR) / "pipelines/wrist" /
                                       ("radius-" + std::string(frame) + ".pose.yaml"));
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

TEST(ReadPose, WhatASearchWroteIsReadBack) {
  const TemporaryFolder folder;
  marrow::Pose written;
  written.world_from_model.translation_mm = {1, -2.5, 0.1};
  written.world_from_model.rotation = marrow::rotation_from_vector({0.1, -0.2, 0.3});
  written.frame.origin_mm = {10, 20, 30};
  written.covariance = marrow::Matrix6d(marrow::Vector6d::LinSpaced(0.01, 0.06).asDiagonal());
  written.warnings = {"mind: the gap"};
  written.cost = 0.125;
  written.evaluations = 20;
  written.convergence = {{10, 2.5}, {20, 0.125}};
  put(folder / "p.yaml", marrow::files::pose(written));
  const marrow::Pose read = pose_at(folder / "p.yaml");
  EXPECT_EQ(read.world_from_model.translation_mm, written.world_from_model.translation_mm);
  EXPECT_EQ(read.world_from_model.rotation, written.world_from_model.rotation);
  EXPECT_EQ(read.frame.origin_mm, written.frame.origin_mm);
  EXPECT_EQ(*read.covariance, *written.covariance);
  EXPECT_EQ(read.warnings, written.warnings);
  EXPECT_EQ(read.cost, written.cost);
  EXPECT_EQ(read.evaluations, written.evaluations);
  ASSERT_EQ(read.convergence.size(), 2u);
  EXPECT_EQ(read.convergence[0].evaluations, 10);
  EXPECT_EQ(read.convergence[1].cost, 0.125);
}

TEST(ReadPose, DiagnosesFaults) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& text, const std::string& said) {
    put(folder / "p.yaml", text);
    EXPECT_SAYS(pose_at(folder / "p.yaml"), said);
  };
  expect(with(kPose, "[1, 0, 0]", "[1, 0]"), "p.yaml:4:11: pose: rotation: expected 3 rows of 3 numbers");
  expect(with(kPose, "[1, 0, 0]", "[-1, 0, 0]"), "not a rotation (off orthonormal by 0");
  expect(with(kPose, "source: ct", "source: world"), "p.yaml:3:9: pose: source: expected the frame 'ct', got 'world'");
  expect(with(kPose, "translation_mm", "translation"), "unknown key 'translation'; did you mean 'translation_mm'?");
  expect(with(kPose, "marrow-pose: 1\n", ""), "key 'marrow-pose' is missing");
  expect(kPose + "covariance: [[1]]\n", "covariance: expected 6 rows of 6 numbers");
  expect(kPose + "convergence: 5\n", "convergence: expected a list, got '5'");
  expect(kPose + "convergence:\n  - [1, 2]\n  - [1.5, 2]\n", "p.yaml:8:5: pose: convergence: expected a pair");
  expect("- a\n", "expected a YAML map of keys and values, got a list of 1");
  expect("", "expected a YAML map of keys and values, got nothing");
  expect(kPose + "---\n" + kPose, "the file goes on after the end of its first document");
}

}  // namespace pose_test
