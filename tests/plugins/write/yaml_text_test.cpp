// SPDX-License-Identifier: Apache-2.0
// The bytes of the files, written out by hand.
#include "marrow/toolbox/files/yaml_text.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "marrow/base/yaml.hpp"
#include "tests/plugins/read/files.hpp"

namespace yaml_text_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Matrix3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string truth_between(const std::string& target, const std::string& source) {
  return files::truth({{target, source, Matrix3d::Identity(), {0.1, -2.5, 1e300}}});
}

TEST(YamlText, NumbersAreTheShortestThatReadAsTheSame) {
  EXPECT_EQ(files::number(0.1), "0.1");
  EXPECT_EQ(files::number(0.1 + 0.2), "0.30000000000000004");
  EXPECT_EQ(files::number(-0.0), "-0");
  EXPECT_EQ(files::number(100000), "1e+05");
  EXPECT_EQ(files::number(std::nan("")), ".nan");
  EXPECT_EQ(files::number(kInfinity), ".inf");
  EXPECT_EQ(files::number(-kInfinity), "-.inf");
}

TEST(YamlText, Truth) {
  EXPECT_EQ(truth_between("world", "ct"), R"(marrow-truth: 1
target: world
source: ct
matrix:  # world_from_ct, mm
  - [1, 0, 0, 0.1]
  - [0, 1, 0, -2.5]
  - [0, 0, 1, 1e+300]
  - [0, 0, 0, 1]
)");
}

TEST(YamlText, Landmarks) {
  Landmarks landmarks;
  landmarks.points = {{"a", {1, 2, 3}}, {"b", {0.1, 0, -1}}};
  EXPECT_EQ(files::landmarks(landmarks, "bone"), R"(marrow-landmarks: 1
fragments:
  "bone":
    points:  # mm, in CT coordinates
      "a": [1, 2, 3]
      "b": [0.1, 0, -1]
)");
  landmarks.seen = {{"a", "left", {10, 20.5}}, {"a", "right", {11, 21}}, {"b", "left", {12, 22}}};
  landmarks.tracked = {{"b", {7, 8, 9}}};
  EXPECT_EQ(files::landmarks(landmarks, "yes"), R"(marrow-landmarks: 1
fragments:
  "yes":
    points:  # mm, in CT coordinates
      "a": [1, 2, 3]
      "b": [0.1, 0, -1]
    seen:  # px, [u, v] by view
      "left":
        "a": [10, 20.5]
        "b": [12, 22]
      "right":
        "a": [11, 21]
    tracked:  # mm, in the world
      "b": [7, 8, 9]
)");
  landmarks.seen[0].deviation_px = 1.5;
  EXPECT_NE(files::landmarks(landmarks, "bone").find(R"(    seen:  # px, [u, v, deviation] by view
      "left":
        "a": [10, 20.5, 1.5]
        "b": [12, 22]
)"),
            std::string::npos);
}

TEST(YamlText, OddNamesAreQuotedAndReadBack) {
  const std::string long_name(2000, 'w');
  for (const std::string name : {"Left-1_b", long_name.c_str(),
                                 "yes",      "Off",
                                 "null",     "~",
                                 "1",        "1e5",
                                 "0x10",     ".inf",
                                 "",         " a ",
                                 "a: b",     "#x",
                                 "x #y",     "- x",
                                 "[a]",      "&a",
                                 "a, b",     "a\nb: 1",
                                 "a\tb",     "\x07",
                                 "\"\\",     "ä",
                                 "日本",     "\x1b[1m"}) {
    const bool is_plain = name == "Left-1_b" || name == long_name;
    std::string escaped = with_each(with_each(name, "\\", "\\\\"), "\"", "\\\"");
    escaped = with_each(with_each(escaped, "\n", "\\n"), "\t", "\\t");
    escaped = with_each(with_each(escaped, "\x07", "\\x07"), "\x1b", "\\x1b");
    const std::string written = is_plain ? name : "\"" + escaped + "\"";
    const std::string text = truth_between("world", name);
    EXPECT_NE(text.find("\nsource: " + written + "\nmatrix:  # world_from_" + written + ", mm\n  - ["),
              std::string::npos)
        << text;
    const YAML::Node read = parse_yaml(text);
    EXPECT_EQ(read.size(), 4u) << text;
    EXPECT_EQ(read["source"].Scalar(), name);
    EXPECT_EQ(read["source"].Tag(), is_plain ? "?" : "!") << "a text, whatever it looks like";
  }
}

TEST(YamlText, Camera) {
  Camera camera{640, 480, Matrix3d::Identity(), {"camera", "world"}};
  camera.intrinsics << 1000.5, 0, 320, 0, 1e6, 240, 0, 0, 1;
  camera.camera_from_world.translation_mm = {1, 2, 600};
  EXPECT_EQ(files::camera(camera), R"(marrow-camera: 1
width_px: 640
height_px: 480
intrinsics:  # pixel = intrinsics * camera point, divided by the third coordinate
  - [1000.5, 0, 320]
  - [0, 1e+06, 240]
  - [0, 0, 1]
camera_from_world:
  target: camera
  source: world
  matrix:  # camera_from_world, mm
    - [1, 0, 0, 1]
    - [0, 1, 0, 2]
    - [0, 0, 1, 600]
    - [0, 0, 0, 1]
)");
}

const std::string kFrameOfPose = R"(fragment_frame:  # the axes that the deviations are about, in CT coordinates; )"
                                 R"(columns: frontal, lateral, long
  origin_mm: [10, 20, 30]
  axes:
    - [0, 1, 0]
    - [0, 0, 1]
    - [1, 0, 0]
)";
const std::string kTransformOfPose = R"(marrow-pose: 1
target: world
source: ct
matrix:  # world_from_ct, mm
  - [1, 0, 0, 0]
  - [0, 1, 0, 0]
  - [0, 0, 1, 0]
  - [0, 0, 0, 1]
)";
const std::string kDeviationsOfPose =
    "predicted_deviation:  # one standard deviation about and along the fragment's frontal, lateral and long axes\n";

Pose example_pose() {
  Pose pose;
  pose.frame.origin_mm = {10, 20, 30};
  pose.frame.axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  pose.frame.is_anatomical = true;
  return pose;
}

TEST(YamlText, PoseOfASearch) {
  Pose pose = example_pose();
  pose.covariance = Matrix6d(Vector6d(0, 0, 0, 4, 0.25, 9).asDiagonal());
  (*pose.covariance)(0, 5) = -1e-5;
  pose.warnings = {"mind: the \"gap\"", "1", "a\nb", ""};
  pose.cost = -0.125;
  pose.evaluations = 20;
  pose.convergence = {{10, 2.5}, {20, kInfinity}};
  EXPECT_EQ(files::pose(pose), kTransformOfPose + kDeviationsOfPose + R"(  rotation_deg: [0, 0, 0]
  translation_mm: [2, 0.5, 3]
warnings:
  - "mind: the \"gap\""
  - "1"
  - "a\nb"
  - ""
cost: -0.125
evaluations: 20
)" + kFrameOfPose + R"(covariance:  # of rotation [rad] and translation [mm] about and along these axes
  - [0, 0, 0, 0, 0, -1e-05]
  - [0, 0, 0, 0, 0, 0]
  - [0, 0, 0, 0, 0, 0]
  - [0, 0, 0, 4, 0, 0]
  - [0, 0, 0, 0, 0.25, 0]
  - [0, 0, 0, 0, 0, 9]
convergence:  # evaluations, and the least cost after them
  - [10, 2.5]
  - [20, .inf]
)");
}

TEST(YamlText, PoseWithoutAxesOfItsFragment) {
  Pose pose;
  EXPECT_EQ(files::pose(pose), kTransformOfPose + "warnings: []\ncost: 0\nevaluations: 0\n");
  pose = example_pose();
  pose.frame.is_anatomical = false;
  EXPECT_NE(files::pose(pose).find("    - [1, 0, 0]\n  anatomical: false\n"), std::string::npos);
}

TEST(YamlText, PoseOfWhichLittleIsKnown) {
  Pose pose = example_pose();
  pose.cost = kInfinity;
  EXPECT_EQ(files::pose(pose), kTransformOfPose + "warnings: []\nevaluations: 0\n" + kFrameOfPose);
  pose.covariance = Matrix6d::Constant(kInfinity);
  EXPECT_EQ(files::pose(pose), kTransformOfPose + kDeviationsOfPose +
                                   "  rotation_deg: [.inf, .inf, .inf]\n  translation_mm: [.inf, .inf, .inf]\n"
                                   "warnings: []\nevaluations: 0\n" +
                                   kFrameOfPose);
}

TEST(YamlText, ShaftLines) {
  ShaftLines lines;
  lines.left = {{1, 2}, {3, 4.5}};
  lines.right = {{5, 6}, {7, -8}};
  lines.width_mm = 27.5;
  lines.width_deviation_mm = std::nan("");
  lines.log_likelihood = -kInfinity;
  const std::string best = R"(marrow-shaft-lines: 1
left: {from_px: [1, 2], to_px: [3, 4.5]}
right: {from_px: [5, 6], to_px: [7, -8]}
width_mm: 27.5
width_deviation_mm: .nan
log_likelihood: -.inf
)";
  EXPECT_EQ(files::shaft_lines(lines), best + "rejected: []\n");
  const std::string reason = "canal: " + std::string(1500, 'x');
  lines.rejected = {{lines.left, lines.right, reason}, {lines.right, lines.left, "no"}};
  EXPECT_EQ(files::shaft_lines(lines), best + R"(rejected:
  - left: {from_px: [1, 2], to_px: [3, 4.5]}
    right: {from_px: [5, 6], to_px: [7, -8]}
    reason: ")" + reason + R"("
  - left: {from_px: [5, 6], to_px: [7, -8]}
    right: {from_px: [1, 2], to_px: [3, 4.5]}
    reason: "no"
)");
}

TEST(YamlText, Seeds) {
  EXPECT_EQ(files::seeds({"distal: \"2\"", {{0.1, 0.2, 1.0 / 3}, {1, 2, 3}}, false}), R"(marrow-seeds: 1
fragments:
  "distal: \"2\"":
    seeds:  # mm, in CT coordinates
      - [0.1, 0.2, 0.3333333333333333]
      - [1, 2, 3]
    register: false
)");
}

}  // namespace yaml_text_test
