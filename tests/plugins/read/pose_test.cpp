// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>

#include "marrow/toolbox/files/yaml_text.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/reading.hpp"

namespace pose_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Matrix3d;

Pose pose_at(const std::filesystem::path& path) { return read_by<Pose>("read.pose", path); }

using ReadPose = InAFolder;

const std::string kPose = R"(marrow-pose: 1
target: world
source: ct
rotation: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
translation_mm: [1, -2.5, 3e2]
)";

TEST_F(ReadPose, RotationAndTranslation) {
  put(folder / "p.yaml", kPose);
  const Pose value = pose_at(folder / "p.yaml");
  EXPECT_EQ(value.world_from_model.target, "world");
  EXPECT_EQ(value.world_from_model.source, "ct");
  EXPECT_EQ(value.world_from_model * Vector3d(10, 0, 0), Vector3d(1, 7.5, 300));
  EXPECT_FALSE(value.covariance);
}

// The shipped placements of the real radius agree with the affine matrices that they were made from, which count voxels
// from their corners.
TEST_F(ReadPose, PlacementsOfTheWrist) {
  MARROW_NEED_DATA(data, "wrist/start.json");
  const YAML::Node starts = YAML::LoadFile(data)["radius"];
  for (const char* frame : {"0002", "0158"}) {
    const Pose value = pose_at(std::filesystem::path(MARROW_SOURCE_DIR) / "pipelines/wrist" /
                               ("radius-" + std::string(frame) + ".pose.yaml"));
    const auto rows = starts[frame]["index_to_world_3x4"].as<std::vector<std::vector<double>>>();
    for (const Vector3d& index : {Vector3d(0, 0, 0), Vector3d(67, 85, 0), Vector3d(30, 40, 127)}) {
      const Vector3d world = value.world_from_model * index.cwiseProduct(Vector3d(0.39625, 0.39625, 0.625));
      for (int r = 0; r < 3; ++r) {
        const double expected =
            rows[r][0] * (index[0] + 0.5) + rows[r][1] * (index[1] + 0.5) + rows[r][2] * (index[2] + 0.5) + rows[r][3];
        EXPECT_NEAR(world[r], expected, 0.02) << frame;
      }
    }
  }
}

TEST_F(ReadPose, WhatASearchWroteIsReadBack) {
  Pose written;
  written.world_from_model.translation_mm = {1, -2.5, 0.1};
  written.world_from_model.rotation = rotation_from_vector({0.1, -0.2, 0.3});
  written.frame.origin_mm = {10, 20, 30};
  written.covariance = Matrix6d(Vector6d::LinSpaced(0.01, 0.06).asDiagonal());
  written.warnings = {"mind: the gap"};
  written.cost = 0.125;
  written.evaluations = 20;
  written.convergence = {{10, 2.5}, {20, 0.125}};
  put(folder / "p.yaml", files::pose(written));
  const Pose read = pose_at(folder / "p.yaml");
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

TEST_F(ReadPose, DiagnosesFaults) {
  const std::string of_five =
      "[0, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]\n";
  expect_faults(
      folder / "p.yaml", kPose,
      {{"[1, 0, 0]", "[1, 0]", "p.yaml:4:11: pose: rotation: expected 3 rows of 3 numbers"},
       {"[1, 0, 0]", "[-1, 0, 0]", "not a rotation (off orthonormal by 0"},
       {"source: ct", "source: world",
        "p.yaml:3:9: pose: source: expected the frame of what was registered, such as 'ct' or 'implant', got 'world'"},
       {"target: world", "target: ct", "p.yaml:2:9: pose: target: expected the frame 'world', got 'ct'"},
       {"translation_mm", "translation", "unknown key 'translation'; did you mean 'translation_mm'?"},
       {"marrow-pose: 1\n", "", "key 'marrow-pose' is missing"},
       {"", kPose + "covariance: [[1]]\n", "covariance: expected 6 rows of 6 numbers"},
       {"", kPose + "covariance: [[-1, 0, 0, 0, 0, 0], " + of_five,
        "p.yaml:6:13: pose: covariance: the covariance has the negative variance -1 in row 1, column 1; a covariance "
        "is symmetric and has no negative eigenvalue"},
       {"", kPose + "covariance: [[1, 0, 0, 0, 0, 0.5], " + of_five,
        "p.yaml:6:13: pose: covariance: the covariance is not symmetric: 0.5 in row 1, column 6, but 0 in row 6, "
        "column 1; a covariance is symmetric and has no negative eigenvalue"},
       {"", kPose + "convergence: 5\n", "convergence: expected a list, got '5'"},
       {"", kPose + "convergence:\n  - [1, 2]\n  - [1.5, 2]\n", "p.yaml:8:5: pose: convergence: expected a pair"},
       {"", "- a\n", "expected a YAML map of keys and values, got a list of 1"},
       {"", "", "expected a YAML map of keys and values, got nothing"},
       {"", kPose + "---\n" + kPose, "the file goes on after the end of its first document"}},
      pose_at);
}

/// A box of 20 x 24 x 100 mm whose middle is at (30, 0, 0), along the direction that turn() makes of z.
Matrix3d turn() { return rotation_from_vector({0.5, -0.6, 0}); }
Mesh oblique_box() {
  Mesh mesh;
  for (const double z : {-50, 50})
    for (const double y : {-12, 12})
      for (const double x : {-10, 10}) mesh.vertices_mm.push_back(turn() * Vector3d(x, y, z) + Vector3d(30, 0, 0));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

Pose pose_of_box_at(const std::filesystem::path& path) {
  return shipped::call("read.pose", {{"model", shipped::item(oblique_box())}}, {{"path", path.string()}})
      .at("pose")
      .as<Pose>();
}

TEST_F(ReadPose, TheModelGivesTheAxesThatATransformFileDoesNotHave) {
  put(folder / "p.tfm", R"(#Insight Transform File V1.0
#Transform 0
Transform: AffineTransform_double_3_3
Parameters: 1 0 0 0 1 0 0 0 1 -4 5 -6
FixedParameters: 0 0 0
)");
  EXPECT_FALSE(pose_at(folder / "p.tfm").frame.is_anatomical);
  const Pose pose = pose_of_box_at(folder / "p.tfm");
  EXPECT_TRUE(pose.frame.is_anatomical);
  EXPECT_LT((pose.frame.origin_mm - Vector3d(30, 0, 0)).norm(), 1e-9);
  EXPECT_LT((pose.frame.axes.col(2) - turn().col(2)).norm(), 1e-9);
  EXPECT_EQ(pose.world_from_model.translation_mm, Vector3d(4, -5, 6));
}

TEST_F(ReadPose, TheModelTurnsTheCovarianceToItsAxes) {
  // By hand: 0.1 degrees about the CT's z, which runs 30 mm beside the box's middle, moves the middle by 30 mm * 0.1
  // degrees along y. The box's axes: the long one; x made orthogonal to it; the one that completes them.
  const Vector3d along = turn().col(2), across = Vector3d::UnitX() - along * along.x();
  Matrix3d axes;
  axes << across.normalized(), along.cross(across.normalized()), along;
  const double angle = radians(0.1);
  put(folder / "p.yaml", kPose + "covariance:\n  - [0, 0, 0, 0, 0, 0]\n  - [0, 0, 0, 0, 0, 0]\n  - [0, 0, " +
                             std::to_string(1e6 * angle * angle) + "e-6, 0, 0, 0]\n" +
                             "  - [0, 0, 0, 0, 0, 0]\n  - [0, 0, 0, 0, 0, 0]\n  - [0, 0, 0, 0, 0, 0]\n");
  const Pose pose = pose_of_box_at(folder / "p.yaml");
  Vector6d motion;
  motion << angle * axes.row(2).transpose(), 30 * angle * axes.row(1).transpose();
  EXPECT_LT((*pose.covariance - motion * motion.transpose()).norm(), 1e-5 * motion.squaredNorm());
}

TEST_F(ReadPose, RefusesAModelInAnotherFrame) {
  put(folder / "p.yaml", kPose);
  Mesh mesh = oblique_box();
  mesh.frame = "elsewhere";
  EXPECT_EQ(
      shipped::refusal("read.pose", {{"model", shipped::item(mesh)}}, {{"path", (folder / "p.yaml").string()}}),
      "the model is in the frame 'elsewhere', but the pose takes points in 'ct'; give the model that was registered");
}

}  // namespace pose_test
