// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <marrow/testing/node.hpp>

namespace fs = std::filesystem;
namespace node_test = marrow::node_test;

namespace {

fs::path written(const std::string& text) {
  const fs::path file = fs::temp_directory_path() / "new-node-pose.yaml";
  std::ofstream(file) << text;
  return file;
}

}  // namespace

TEST(NewNode, ReadsAQuarterTurnAndAShift) {
  const fs::path file = written(
      "marrow-pose: 1\ntarget: world\nsource: ct\nmatrix:\n  - [0, -1, 0, 12.5]\n  - [1, 0, 0, -7]\n"
      "  - [0, 0, 1, 300]\n  - [0, 0, 0, 1]\n");
  const auto found = node_test::call("read.new_node", {}, {{"path", file}});
  const marrow::RigidTransform pose = found.at("pose").as<marrow::Pose>().world_from_model;
  EXPECT_LT((pose * Eigen::Vector3d(10, 20, 30) - Eigen::Vector3d(-7.5, 3, 330)).norm(), 1e-12);
}

TEST(NewNode, NamesAFileThatHoldsNoPose) {
  const fs::path file = written("nothing\n");
  try {
    node_test::call("read.new_node", {}, {{"path", file}});
    FAIL() << "it took a file without a pose";
  } catch (const marrow::Error& error) {
    EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos) << error.what();
  }
}
