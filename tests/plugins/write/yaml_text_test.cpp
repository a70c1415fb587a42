// SPDX-License-Identifier: Apache-2.0
// The bytes of the files, written out by hand, and values that read back the same.
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/write/writing.hpp"

namespace yaml_text_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Matrix3d;
using writing::write;
using WriteText = InAFolder;

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
  EXPECT_HAS(files::landmarks(landmarks, "bone"), R"(    seen:  # px, [u, v, deviation] by view
      "left":
        "a": [10, 20.5, 1.5]
        "b": [12, 22]
)");
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
    EXPECT_HAS(text, "\nsource: " + written + "\nmatrix:  # world_from_" + written + ", mm\n  - [");
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
  EXPECT_HAS(files::pose(pose), "    - [1, 0, 0]\n  anatomical: false\n");
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

Pose pose_of_a_search() {
  Pose value;
  value.world_from_model.rotation = rotation_from_vector({0.1, -0.7, 1.3});
  value.world_from_model.translation_mm = {1.0 / 3, -2e-7, 812.25};
  value.frame.origin_mm = {0.1, 0.2, 0.3};
  value.frame.axes = rotation_from_vector({0, 0.2, 0});
  value.covariance = Matrix6d::Identity() * 1e-6;
  (*value.covariance)(2, 2) = std::pow(radians(0.35), 2);
  (*value.covariance)(3, 3) = 0.04;
  value.warnings = {"axial rotation is not seen: \"bare\" shaft", "line\nbreak: # no comment"};
  value.cost = 1.0 / 7;
  value.evaluations = 321;
  return value;
}

TEST_F(WriteText, PosesReadBackTheSameToTheLastBit) {
  write(pose_of_a_search(), folder / "pose.yaml");
  EXPECT_EQ(hash_of(files::read_pose_file(folder / "pose.yaml")), hash_of(pose_of_a_search()));
  const std::string text = bytes_of(folder / "pose.yaml");
  EXPECT_HAS(text, "target: world\nsource: ct\nmatrix:  # world_from_ct, mm\n");
  EXPECT_HAS(text, "predicted_deviation:");
  EXPECT_HAS(text, ", 0.35") << "degrees about the long axis\n" << text;
  // A nail is registered in a frame of its own.
  Pose value = pose_of_a_search();
  value.world_from_model.source = "implant";
  write(value, folder / "pose.yaml");
  const Pose read = files::read_pose_file(folder / "pose.yaml");
  EXPECT_EQ(hash_of(read), hash_of(value));
  EXPECT_EQ(read.world_from_model.source, "implant");
}

// A run writes a list's items to files with escaped names. The content of a file is for people.
TEST_F(WriteText, LandmarksNameTheirFragmentAsItIs) {
  Landmarks landmarks;
  landmarks.points = {{"a", {1, 2, 3}}};
  write(landmarks, folder / "L%2FR.yaml");
  const YAML::Node written = YAML::LoadFile((folder / "L%2FR.yaml").string());
  EXPECT_EQ(written["fragments"].begin()->first.as<std::string>(), "L/R") << bytes_of(folder / "L%2FR.yaml");
}

TEST_F(WriteText, PoseWithoutPredictionAndWithInfinities) {
  Pose value = pose_of_a_search();
  value.covariance.reset();
  value.warnings.clear();
  write(value, folder / "pose.yaml");
  EXPECT_EQ(hash_of(files::read_pose_file(folder / "pose.yaml")), hash_of(value));
  value.covariance = Matrix6d::Constant(std::numeric_limits<double>::infinity());
  write(value, folder / "pose.yaml");
  EXPECT_FALSE(files::read_pose_file(folder / "pose.yaml").covariance);
  EXPECT_HAS(bytes_of(folder / "pose.yaml"), "rotation_deg: [.inf, .inf, .inf]");
}

TEST_F(WriteText, CameraAndSeedsReadBackTheSame) {
  Camera written{
      512, 384, Matrix3d::Identity(), {"camera", "world", rotation_from_vector({1, 2, 3}), {1.0 / 3, 2, 600}}};
  written.intrinsics(0, 0) = 1706.484641638225;
  write(written, folder / "c.yaml");
  EXPECT_EQ(hash_of(files::read_camera_file(folder / "c.yaml").camera), hash_of(written));
  const Seeds points{"distal: \"2\"", {{0.1, 0.2, 1.0 / 3}}, false};
  write(points, folder / "s.yaml");
  EXPECT_EQ(hash_of(files::read_seeds_file(folder / "s.yaml")[0]), hash_of(points));
}

TEST_F(WriteText, MetricsAreJson) {
  write(Metrics{{{"rotation error", 0.1, "deg"}, {"impossible", std::nan(""), "mm"}}}, folder / "m.json");
  const auto json = nlohmann::json::parse(bytes_of(folder / "m.json"));
  EXPECT_EQ(json["metrics"][0]["name"], "rotation error");
  EXPECT_EQ(json["metrics"][0]["value"], 0.1);
  EXPECT_TRUE(json["metrics"][1]["value"].is_null());
}

TEST_F(WriteText, VerdictReadsBackTheSame) {
  Verdict verdict{Judgement::wrong,
                  1.0 / 3,
                  {"the rotation: \"unknown\"", "line\nbreak"},
                  {"a third view"},
                  {{"spread", 0.1, "mm"}, {"share", 2, ""}, {"nothing", std::nan(""), "deg"}}};
  write(verdict, folder / "v.yaml");
  EXPECT_EQ(hash_of(files::read_verdict_file(folder / "v.yaml")), hash_of(verdict)) << bytes_of(folder / "v.yaml");
  write(Verdict{}, folder / "v.yaml");
  EXPECT_EQ(bytes_of(folder / "v.yaml"),
            "marrow-verdict: 1\njudgement: doubtful\nfailure_probability: .nan\nreasons: []\nremedies: []\n"
            "figures: []\n");
  EXPECT_EQ(hash_of(files::read_verdict_file(folder / "v.yaml")), hash_of(Verdict{}));
}

TEST_F(WriteText, WhatIsNoVerdictIsRefused) {
  put(folder / "v.yaml",
      "marrow-verdict: 1\njudgement: splendid\nfailure_probability: 1.5\nfigures: [{name: a, value: much}]\n");
  for (const char* fault : {"v.yaml:2:12: verdict: judgement: expected trusted, doubtful or wrong, got 'splendid'",
                            "v.yaml:3:22: verdict: failure_probability: expected a number from 0 to 1, or .nan if it "
                            "is not known, got 1.5",
                            "v.yaml:4:28: a figure: value: expected a number, got 'much'"})
    EXPECT_SAYS(files::read_verdict_file(folder / "v.yaml"), fault);
}

TEST_F(WriteText, ShaftLinesAndTruthAreYamlAndReplaceNoFolder) {
  ShaftLines lines;
  lines.left = {{1, 2}, {3, 4.5}};
  lines.rejected.push_back({{{5, 6}, {7, 8}}, {{9, 10}, {11, 12}}, "canal: too narrow"});
  write(lines, folder / "l.yaml");
  const YAML::Node yaml = YAML::LoadFile(folder / "l.yaml");
  EXPECT_EQ(yaml["left"]["to_px"][1].as<double>(), 4.5);
  EXPECT_EQ(yaml["rejected"][0]["reason"].as<std::string>(), "canal: too narrow");
  write(Truth{pose_of_a_search().world_from_model}, folder / "t.yaml");
  EXPECT_EQ(YAML::LoadFile(folder / "t.yaml")["matrix"][2][3].as<double>(), 812.25);
  std::filesystem::create_directory(folder / "p.yaml");
  EXPECT_SAYS(write(pose_of_a_search(), folder / "p.yaml"), "p.yaml: cannot be written");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "p.yaml"));
}

TEST_F(WriteText, ThreadsThatWriteTheSameFileLeaveOneOfThemWhole) {
  std::vector<std::thread> writers;
  for (int k = 0; k < 4; ++k)
    writers.emplace_back([&, k] {
      for (int i = 0; i < 200; ++i)
        EXPECT_NO_THROW(files::write_text(folder / "file", std::string(20000, char('a' + k))));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string text = bytes_of(folder / "file");
  EXPECT_EQ(text, std::string(20000, text.at(0)));
}

}  // namespace yaml_text_test
