// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "tests/harness/message_of.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace text_test {

using marrow::test::bytes_of;
using marrow::test::TemporaryFolder;
using writing::write;

marrow::Pose example_pose() {
  marrow::Pose value;
  value.world_from_model.rotation = marrow::rotation_from_vector({0.1, -0.7, 1.3});
  value.world_from_model.translation_mm = {1.0 / 3, -2e-7, 812.25};
  value.frame.origin_mm = {0.1, 0.2, 0.3};
  value.frame.axes = marrow::rotation_from_vector({0, 0.2, 0});
  value.covariance = marrow::Matrix6d::Identity() * 1e-6;
  (*value.covariance)(2, 2) = std::pow(marrow::radians(0.35), 2);
  (*value.covariance)(3, 3) = 0.04;
  value.warnings = {"axial rotation is not seen: \"bare\" shaft", "line\nbreak: # no comment"};
  value.cost = 1.0 / 7;
  value.evaluations = 321;
  return value;
}

TEST(WriteText, PoseReadsBackTheSameToTheLastBit) {
  const TemporaryFolder folder;
  write(example_pose(), folder / "pose.yaml");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_pose_file(folder / "pose.yaml")), marrow::hash_of(example_pose()));
  const std::string text = bytes_of(folder / "pose.yaml");
  EXPECT_NE(text.find("target: world\nsource: ct\nmatrix:  # world_from_ct, mm\n"), std::string::npos) << text;
  EXPECT_NE(text.find("predicted_deviation:"), std::string::npos);
  EXPECT_NE(text.find(", 0.35"), std::string::npos) << "degrees about the long axis\n" << text;
}

// A nail is registered in a frame of its own.
TEST(WriteText, PoseOfAnImplantReadsBackTheSame) {
  const TemporaryFolder folder;
  marrow::Pose value = example_pose();
  value.world_from_model.source = "implant";
  write(value, folder / "pose.yaml");
  const marrow::Pose read = marrow::files::read_pose_file(folder / "pose.yaml");
  EXPECT_EQ(marrow::hash_of(read), marrow::hash_of(value));
  EXPECT_EQ(read.world_from_model.source, "implant");
}

// A run writes a list's items to files with escaped names. The content of a file is for people.
TEST(WriteText, LandmarksNameTheirFragmentAsItIs) {
  const TemporaryFolder folder;
  marrow::Landmarks landmarks;
  landmarks.points = {{"a", {1, 2, 3}}};
  write(landmarks, folder / "L%2FR.yaml");
  const YAML::Node written = YAML::LoadFile((folder / "L%2FR.yaml").string());
  EXPECT_EQ(written["fragments"].begin()->first.as<std::string>(), "L/R") << bytes_of(folder / "L%2FR.yaml");
}

TEST(WriteText, PoseWithoutPredictionAndWithInfinities) {
  const TemporaryFolder folder;
  marrow::Pose value = example_pose();
  value.covariance.reset();
  value.warnings.clear();
  write(value, folder / "pose.yaml");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_pose_file(folder / "pose.yaml")), marrow::hash_of(value));
  value.covariance = marrow::Matrix6d::Constant(std::numeric_limits<double>::infinity());
  write(value, folder / "pose.yaml");
  EXPECT_FALSE(marrow::files::read_pose_file(folder / "pose.yaml").covariance);
  EXPECT_NE(bytes_of(folder / "pose.yaml").find("rotation_deg: [.inf, .inf, .inf]"), std::string::npos);
}

TEST(WriteText, CameraAndSeedsReadBackTheSame) {
  const TemporaryFolder folder;
  marrow::Camera written{512,
                         384,
                         Eigen::Matrix3d::Identity(),
                         {"camera", "world", marrow::rotation_from_vector({1, 2, 3}), {1.0 / 3, 2, 600}}};
  written.intrinsics(0, 0) = 1706.484641638225;
  write(written, folder / "c.yaml");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_camera_file(folder / "c.yaml").camera), marrow::hash_of(written));
  const marrow::Seeds points{"distal: \"2\"", {{0.1, 0.2, 1.0 / 3}}, false};
  write(points, folder / "s.yaml");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_seeds_file(folder / "s.yaml")[0]), marrow::hash_of(points));
}

TEST(WriteText, MetricsAreJson) {
  const TemporaryFolder folder;
  write(marrow::Metrics{{{"rotation error", 0.1, "deg"}, {"impossible", std::nan(""), "mm"}}}, folder / "m.json");
  const auto json = nlohmann::json::parse(bytes_of(folder / "m.json"));
  EXPECT_EQ(json["metrics"][0]["name"], "rotation error");
  EXPECT_EQ(json["metrics"][0]["value"], 0.1);
  EXPECT_TRUE(json["metrics"][1]["value"].is_null());
}

TEST(WriteText, VerdictReadsBackTheSame) {
  const TemporaryFolder folder;
  marrow::Verdict verdict{marrow::Judgement::wrong,
                          1.0 / 3,
                          {"the rotation: \"unknown\"", "line\nbreak"},
                          {"a third view"},
                          {{"spread", 0.1, "mm"}, {"share", 2, ""}, {"nothing", std::nan(""), "deg"}}};
  write(verdict, folder / "v.yaml");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_verdict_file(folder / "v.yaml")), marrow::hash_of(verdict))
      << bytes_of(folder / "v.yaml");
  write(marrow::Verdict{}, folder / "v.yaml");
  EXPECT_EQ(bytes_of(folder / "v.yaml"),
            "marrow-verdict: 1\njudgement: doubtful\nfailure_probability: .nan\nreasons: []\nremedies: []\n"
            "figures: []\n");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_verdict_file(folder / "v.yaml")), marrow::hash_of(marrow::Verdict{}));
}

TEST(WriteText, WhatIsNoVerdictIsRefused) {
  const TemporaryFolder folder;
  std::ofstream(folder / "v.yaml") << "marrow-verdict: 1\njudgement: splendid\nfailure_probability: 1.5\n"
                                      "figures: [{name: a, value: much}]\n";
  const std::string text = marrow::test::message_of([&] { marrow::files::read_verdict_file(folder / "v.yaml"); });
  for (const char* fault : {"v.yaml:2:12: verdict: judgement: expected trusted, doubtful or wrong, got 'splendid'",
                            "v.yaml:3:22: verdict: failure_probability: expected a number from 0 to 1, or .nan if it "
                            "is not known, got 1.5",
                            "v.yaml:4:28: a figure: value: expected a number, got 'much'"})
    EXPECT_NE(text.find(fault), std::string::npos) << text;
}

TEST(WriteText, ShaftLinesAndTruthAreYaml) {
  const TemporaryFolder folder;
  marrow::ShaftLines lines;
  lines.left = {{1, 2}, {3, 4.5}};
  lines.rejected.push_back({{{5, 6}, {7, 8}}, {{9, 10}, {11, 12}}, "canal: too narrow"});
  write(lines, folder / "l.yaml");
  const YAML::Node yaml = YAML::LoadFile(folder / "l.yaml");
  EXPECT_EQ(yaml["left"]["to_px"][1].as<double>(), 4.5);
  EXPECT_EQ(yaml["rejected"][0]["reason"].as<std::string>(), "canal: too narrow");
  write(marrow::Truth{example_pose().world_from_model}, folder / "t.yaml");
  EXPECT_EQ(YAML::LoadFile(folder / "t.yaml")["matrix"][2][3].as<double>(), 812.25);
}

TEST(WriteText, FullDisk) {
  const TemporaryFolder folder;
  for (const rlim_t bytes : {0, 200})
    marrow::test::expect_full_disk_is_diagnosed(folder, "p.yaml", bytes,
                                                [](const std::string& path) { write(example_pose(), path); });
}

TEST(WriteText, AFolderOfThatNameIsNotReplaced) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "p.yaml");
  EXPECT_SAYS(write(example_pose(), folder / "p.yaml"), "p.yaml: cannot be written");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "p.yaml"));
}

TEST(WriteText, ThreadsThatWriteTheSameFileLeaveOneOfThemWhole) {
  const TemporaryFolder folder;
  std::vector<std::thread> writers;
  for (int k = 0; k < 4; ++k)
    writers.emplace_back([&, k] {
      for (int i = 0; i < 200; ++i)
        EXPECT_NO_THROW(marrow::files::write_text(folder / "file", std::string(20000, char('a' + k))));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string text = bytes_of(folder / "file");
  EXPECT_EQ(text, std::string(20000, text.at(0)));
}

}  // namespace text_test
