// SPDX-License-Identifier: Apache-2.0
// The bytes of the files, written out by hand.
#include "marrow/toolbox/files/yaml_text.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "marrow/base/yaml.hpp"

namespace yaml_text_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string truth_between(const std::string& target, const std::string& source) {
  return marrow::files::truth({{target, source, Eigen::Matrix3d::Identity(), {0.1, -2.5, 1e300}}});
}

TEST(YamlText, NumbersAreTheShortestThatReadAsTheSame) {
  EXPECT_EQ(marrow::files::number(0.1), "0.1");
  EXPECT_EQ(marrow::files::number(0.1 + 0.2), "0.30000000000000004");
  EXPECT_EQ(marrow::files::number(-0.0), "-0");
  EXPECT_EQ(marrow::files::number(100000), "1e+05");
  EXPECT_EQ(marrow::files::number(std::nan("")), ".nan");
  EXPECT_EQ(marrow::files::number(kInfinity), ".inf");
  EXPECT_EQ(marrow::files::number(-kInfinity), "-.inf");
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
  marrow::Landmarks landmarks;
  landmarks.points = {{"a", {1, 2, 3}}, {"b", {0.1, 0, -1}}};
  EXPECT_EQ(marrow::files::landmarks(landmarks, "bone"), R"(marrow-landmarks: 1
fragments:
  "bone":
    points:  # mm, in CT coordinates
      "a": [1, 2, 3]
      "b": [0.1, 0, -1]
)");
  landmarks.seen = {{"a", "left", {10, 20.5}}, {"a", "right", {11, 21}}, {"b", "left", {12, 22}}};
  landmarks.tracked = {{"b", {7, 8, 9}}};
  EXPECT_EQ(marrow::files::landmarks(landmarks, "yes"), R"(marrow-landmarks: 1
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
  EXPECT_NE(marrow::files::landmarks(landmarks, "bone").find(R"(    seen:  # px, [u, v, deviation] by view
      "left":
        "a": [10, 20.5, 1.5]
        "b": [12, 22]
)"),
            std::string::npos);
}

TEST(YamlText, OddNamesAreQuotedAndReadBack) {
  const std::string long_name(2000, 'w');
  const std::pair<std::string, std::string> names[] = {{"Left-1_b", "Left-1_b"},
                                                       {long_name, long_name},
                                                       {"yes", R"("yes")"},
                                                       {"Off", R"("Off")"},
                                                       {"null", R"("null")"},
                                                       {"~", R"("~")"},
                                                       {"1", R"("1")"},
                                                       {"1e5", R"("1e5")"},
                                                       {"0x10", R"("0x10")"},
                                                       {".inf", R"(".inf")"},
                                                       {"", R"("")"},
                                                       {" a ", R"(" a ")"},
                                                       {"a: b", R"("a: b")"},
                                                       {"#x", R"("#x")"},
                                                       {"x #y", R"("x #y")"},
                                                       {"- x", R"("- x")"},
                                                       {"[a]", R"("[a]")"},
                                                       {"&a", R"("&a")"},
                                                       {"a, b", R"("a, b")"},
                                                       {"a\nb: 1", R"("a\nb: 1")"},
                                                       {"a\tb", R"("a\tb")"},
                                                       {"\x07", R"("\x07")"},
                                                       {"\"\\", R"("\"\\")"},
                                                       {"ä", R"("ä")"},
                                                       {"日本", R"("日本")"},
                                                       {"\x1b[1m", R"("\x1b[1m")"}};
  for (const auto& [name, written] : names) {
    const std::string text = truth_between("world", name);
    EXPECT_NE(text.find("\nsource: " + written + "\nmatrix:  # world_from_" + written + ", mm\n  - ["),
              std::string::npos)
        << text;
    const YAML::Node read = marrow::parse_yaml(text);
    EXPECT_EQ(read.size(), 4u) << text;
    EXPECT_EQ(read["source"].Scalar(), name);
    EXPECT_EQ(read["source"].Tag(), name == written ? "?" : "!") << "a text, whatever it looks like";
  }
}

TEST(YamlText, Camera) {
  marrow::Camera camera{640, 480, Eigen::Matrix3d::Identity(), {"camera", "world"}};
  camera.intrinsics << 1000.5, 0, 320, 0, 1e6, 240, 0, 0, 1;
  camera.camera_from_world.translation_mm = {1, 2, 600};
  EXPECT_EQ(marrow::files::camera(camera), R"(marrow-camera: 1
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

marrow::Pose example_pose() {
  marrow::Pose pose;
  pose.frame.origin_mm = {10, 20, 30};
  pose.frame.axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  pose.frame.is_anatomical = true;
  return pose;
}

TEST(YamlText, PoseOfASearch) {
  marrow::Pose pose = example_pose();
  pose.covariance = marrow::Matrix6d(marrow::Vector6d(0, 0, 0, 4, 0.25, 9).asDiagonal());
  (*pose.covariance)(0, 5) = -1e-5;
  pose.warnings = {"mind: the \"gap\"", "1", "a\nb", ""};
  pose.cost = -0.125;
  pose.evaluations = 20;
  pose.convergence = {{10, 2.5}, {20, kInfinity}};
  EXPECT_EQ(marrow::files::pose(pose), kTransformOfPose + kDeviationsOfPose + R"(  rotation_deg: [0, 0, 0]
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
  marrow::Pose pose;
  EXPECT_EQ(marrow::files::pose(pose), kTransformOfPose + "warnings: []\ncost: 0\nevaluations: 0\n");
  pose = example_pose();
  pose.frame.is_anatomical = false;
  EXPECT_NE(marrow::files::pose(pose).find("    - [1, 0, 0]\n  anatomical: false\n"), std::string::npos);
}

TEST(YamlText, PoseOfWhichLittleIsKnown) {
  marrow::Pose pose = example_pose();
  pose.cost = kInfinity;
  EXPECT_EQ(marrow::files::pose(pose), kTransformOfPose + "warnings: []\nevaluations: 0\n" + kFrameOfPose);
  pose.covariance = marrow::Matrix6d::Constant(kInfinity);
  EXPECT_EQ(marrow::files::pose(pose), kTransformOfPose + kDeviationsOfPose +
                                           "  rotation_deg: [.inf, .inf, .inf]\n  translation_mm: [.inf, .inf, .inf]\n"
                                           "warnings: []\nevaluations: 0\n" +
                                           kFrameOfPose);
}

TEST(YamlText, ShaftLines) {
  marrow::ShaftLines lines;
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
  EXPECT_EQ(marrow::files::shaft_lines(lines), best + "rejected: []\n");
  const std::string reason = "canal: " + std::string(1500, 'x');
  lines.rejected = {{lines.left, lines.right, reason}, {lines.right, lines.left, "no"}};
  EXPECT_EQ(marrow::files::shaft_lines(lines), best + R"(rejected:
  - left: {from_px: [1, 2], to_px: [3, 4.5]}
    right: {from_px: [5, 6], to_px: [7, -8]}
    reason: ")" + reason + R"("
  - left: {from_px: [5, 6], to_px: [7, -8]}
    right: {from_px: [1, 2], to_px: [3, 4.5]}
    reason: "no"
)");
}

TEST(YamlText, Seeds) {
  EXPECT_EQ(marrow::files::seeds({"distal: \"2\"", {{0.1, 0.2, 1.0 / 3}, {1, 2, 3}}, false}), R"(marrow-seeds: 1
fragments:
  "distal: \"2\"":
    seeds:  # mm, in CT coordinates
      - [0.1, 0.2, 0.3333333333333333]
      - [1, 2, 3]
    register: false
)");
}

}  // namespace yaml_text_test
