// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "tests/plugins/write/writing.hpp"

namespace text_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Matrix3d;
using writing::write;

using WriteText = InAFolder;

Pose example_pose() {
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

TEST_F(WriteText, PoseReadsBackTheSameToTheLastBit) {
  write(example_pose(), folder / "pose.yaml");
  EXPECT_EQ(hash_of(files::read_pose_file(folder / "pose.yaml")), hash_of(example_pose()));
  const std::string text = bytes_of(folder / "pose.yaml");
  EXPECT_NE(text.find("target: world\nsource: ct\nmatrix:  # world_from_ct, mm\n"), std::string::npos) << text;
  EXPECT_NE(text.find("predicted_deviation:"), std::string::npos);
  EXPECT_NE(text.find(", 0.35"), std::string::npos) << "degrees about the long axis\n" << text;
}

// A nail is registered in a frame of its own.
TEST_F(WriteText, PoseOfAnImplantReadsBackTheSame) {
  Pose value = example_pose();
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
  Pose value = example_pose();
  value.covariance.reset();
  value.warnings.clear();
  write(value, folder / "pose.yaml");
  EXPECT_EQ(hash_of(files::read_pose_file(folder / "pose.yaml")), hash_of(value));
  value.covariance = Matrix6d::Constant(std::numeric_limits<double>::infinity());
  write(value, folder / "pose.yaml");
  EXPECT_FALSE(files::read_pose_file(folder / "pose.yaml").covariance);
  EXPECT_NE(bytes_of(folder / "pose.yaml").find("rotation_deg: [.inf, .inf, .inf]"), std::string::npos);
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

TEST_F(WriteText, ShaftLinesAndTruthAreYaml) {
  ShaftLines lines;
  lines.left = {{1, 2}, {3, 4.5}};
  lines.rejected.push_back({{{5, 6}, {7, 8}}, {{9, 10}, {11, 12}}, "canal: too narrow"});
  write(lines, folder / "l.yaml");
  const YAML::Node yaml = YAML::LoadFile(folder / "l.yaml");
  EXPECT_EQ(yaml["left"]["to_px"][1].as<double>(), 4.5);
  EXPECT_EQ(yaml["rejected"][0]["reason"].as<std::string>(), "canal: too narrow");
  write(Truth{example_pose().world_from_model}, folder / "t.yaml");
  EXPECT_EQ(YAML::LoadFile(folder / "t.yaml")["matrix"][2][3].as<double>(), 812.25);
}

TEST_F(WriteText, AFolderOfThatNameIsNotReplaced) {
  std::filesystem::create_directory(folder / "p.yaml");
  EXPECT_SAYS(write(example_pose(), folder / "p.yaml"), "p.yaml: cannot be written");
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

}  // namespace text_test
