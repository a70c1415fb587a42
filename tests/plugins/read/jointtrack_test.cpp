// SPDX-License-Identifier: Apache-2.0
// JointTrack's poses and calibration, against rotations that are known by hand.
#include <gtest/gtest.h>

#include "marrow/toolbox/exchange/jointtrack_poses.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"

namespace jointtrack_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;

const std::string kHeader = "JT_EULER_312\n x_tran, y_tran, z_tran, z_rot, x_rot, y_rot\n";

class ReadJointTrack : public testing::Test {
 protected:
  shipped::Outputs read(const std::string& text, std::vector<std::string> radians = {},
                        const std::string& axes = "y_up") {
    put(folder / "a.jts", text);
    return shipped::call("read.jointtrack", {},
                         {{"path", (folder / "a.jts").string()}, {"radians", radians}, {"rotation_axes", axes}});
  }
  marrow::RigidTransform first(const std::string& text, std::vector<std::string> radians = {},
                               const std::string& axes = "y_up") {
    return read(text, radians, axes).at("poses").as_list<marrow::Pose>()[0].world_from_model;
  }
  std::string refusal(const std::string& text) {
    put(folder / "a.jts", text);
    const std::string said = shipped::refusal("read.jointtrack", {}, {{"path", (folder / "a.jts").string()}});
    const std::string where = (folder / "a.jts").string();
    return said.starts_with(where) ? said.substr(where.size()) : said;
  }
  TemporaryFolder folder;
};

// JointTrack's camera has y up and z towards the source, OpenCV's y down and z away from it.
TEST_F(ReadJointTrack, AQuarterAboutZThenTheAxesOfOpenCv) {
  const marrow::RigidTransform pose = first(kHeader + "1, 2, -300, 90, 0, 0\n");
  EXPECT_LT((pose.translation_mm - Eigen::Vector3d(1, -2, 300)).norm(), 1e-12);
  // x of the model points up in the image, which is -y of OpenCV; y to the left.
  EXPECT_LT((pose.rotation.col(0) - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_LT((pose.rotation.col(1) - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-12);
}

TEST_F(ReadJointTrack, TheRotationsAreAppliedAsRzRxRy) {
  // y first: z of the model to x, then x stays, then z turns x to y (up).
  const marrow::RigidTransform pose = first(kHeader + "0, 0, -300, 90, 0, 90\n");
  EXPECT_LT((pose.rotation.col(2) - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12);
}

TEST_F(ReadJointTrack, ColumnsMayBeInRadiansAndTheRotationsAboutOpenCvsAxes) {
  const marrow::RigidTransform in_degrees = first(kHeader + "0, 0, -300, 45, 20, 90\n"),
                               mixed = first(kHeader + "0, 0, -300, 0.78539816339744831, 20, 1.5707963267948966\n",
                                             {"z_rot", "y_rot"});
  EXPECT_LT((in_degrees.rotation - mixed.rotation).norm(), 1e-12);
  const marrow::RigidTransform y_down = first(kHeader + "1, 2, -300, 90, 0, 0\n", {}, "y_down");
  EXPECT_LT((y_down.rotation.col(0) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_LT((y_down.translation_mm - Eigen::Vector3d(1, -2, 300)).norm(), 1e-12);
}

TEST_F(ReadJointTrack, AFrameNotOptimizedHasNoPoseAndMovesNoOther) {
  const auto poses =
      read(
          "JTA_EULER_KINEMATICS\nX_TRAN\tY_TRAN\n1,\t2,\t-300,\t40,\t50,\t60,\nNOT_OPTIMIZED,\t0,\t0,\t0,\t0,\t0,\n"
          "3,\t2,\t-300,\t40,\t50,\t60,\n")
          .at("poses")
          .as_list<marrow::Pose>();
  EXPECT_EQ(poses.names(), (std::vector<std::string>{"0001", "0003"}));
  EXPECT_EQ(poses[1].world_from_model.translation_mm.x(), 3);
}

TEST_F(ReadJointTrack, WhatIsWrittenIsReadBack) {
  marrow::List<marrow::Pose> poses;
  marrow::Pose pose;
  pose.world_from_model.rotation = marrow::rotation_from_vector({2.1, -0.7, 0.3});
  pose.world_from_model.translation_mm = {4.5, -20, 1080};
  poses.add("0003", pose);
  const auto written = shipped::call("write.jointtrack", {{"poses", shipped::list(poses, "frame")}});
  const marrow::Catalogue catalogue;
  for (const char* format : {"jts", "jtak"}) {
    const auto& file = written.at(format);
    catalogue.load_writer(file.type).write(file.data.get(), (folder / "b").string());
    const auto again =
        shipped::call("read.jointtrack", {}, {{"path", (folder / "b").string()}}).at("poses").as_list<marrow::Pose>();
    EXPECT_EQ(again.names(), (std::vector<std::string>{"0003"}));
    EXPECT_LT((again[0].world_from_model.rotation - pose.world_from_model.rotation).norm(), 1e-9) << format;
    EXPECT_LT((again[0].world_from_model.translation_mm - pose.world_from_model.translation_mm).norm(), 1e-7);
  }
}

TEST_F(ReadJointTrack, ACalibrationIsACameraAndOffsetsAreMmWithYUp) {
  put(folder / "calibration.txt", "JT_INTCALIB\n1000\n2\n3\n0.5\n");
  const auto camera =
      shipped::call("read.camera", {},
                    {{"path", (folder / "calibration.txt").string()}, {"image_size_px", std::vector<double>{101, 201}}})
          .at("camera")
          .as<marrow::Camera>();
  Eigen::Matrix3d expected;
  expected << 2000, 0, 54, 0, 2000, 94, 0, 0, 1;
  EXPECT_LT((camera.intrinsics - expected).norm(), 1e-12);
}

TEST_F(ReadJointTrack, NumbersThatLookLikeTheOtherUnitAreDoubted) {
  const auto doubts = [&](const std::string& text, const std::vector<std::string>& radians) {
    put(folder / "a.jts", text);
    std::vector<std::string> said = marrow::exchange::read_jointtrack_poses(folder / "a.jts", {radians}).doubts;
    for (std::string& one : said) one = one.substr((folder / "a.jts").string().size() + 2);
    return said;
  };
  const std::string in_degrees = kHeader + "0, 0, -300, 45, -20, 90\n",
                    in_radians = kHeader + "0, 0, -300, 1.5, -20, 90\n0, 0, -300, -2.5, -20, 90\n";
  EXPECT_EQ(doubts(in_degrees, {}), std::vector<std::string>{});
  EXPECT_EQ(doubts(in_radians, {"z_rot"}), std::vector<std::string>{});
  EXPECT_EQ(doubts(in_radians, {}),
            std::vector<std::string>{"z_rot was taken in degrees, but is never more than 2.5: either the implant is "
                                     "hardly turned about this axis, or these are radians; then give radians=[z_rot]"});
  EXPECT_EQ(
      doubts(in_degrees, {"x_rot"}),
      std::vector<std::string>{"x_rot was taken in radians, but reaches 20: these look like degrees; leave it out "
                               "of 'radians'"});
}

TEST_F(ReadJointTrack, SaysWhatIsWrong) {
  EXPECT_EQ(
      refusal("JT_EULER_321\n"),
      ":1: expected JT_EULER_312 or JTA_EULER_KINEMATICS, got 'JT_EULER_321'; save the kinematics as .jts or .jtak "
      "in JointTrack");
  EXPECT_EQ(refusal(kHeader + "1, 2, 3\n"),
            ":3: expected 6 numbers (x, y, z in mm; rotations about z, x, y), got 3 words");
  EXPECT_EQ(refusal(kHeader + "1, 2, 3, 4, 5, nan\n"), ":3: expected numbers of at most 1e6, got 'nan'");
  EXPECT_EQ(refusal(kHeader), ": there is no pose in it; each frame has a line of 6 numbers");
}

}  // namespace jointtrack_test
