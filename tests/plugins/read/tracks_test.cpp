// SPDX-License-Identifier: Apache-2.0
// Poses in files of other programs: Autoscoper's .tra, and JointTrack's poses and calibration, against rotations that
// are known by hand.
#include "marrow/toolbox/exchange/jointtrack_poses.hpp"
#include "marrow/toolbox/track/track_state.hpp"
#include "tests/harness/comma_locale.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/reading.hpp"
#include "tests/plugins/write/writing.hpp"

namespace tracks_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using track::AutoscoperTrack, track::TrackState;

/// Writes a value by the writer of its type.
void write(const Value& value, const std::filesystem::path& path) {
  writing::writer_of(value.type).write(value.data.get(), path.string());
}

const std::string kQuarter = "0,-1,0,1,1,0,0,-2.5,0,0,1,300,0,0,0,1\n";
const std::string kLost = "NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN\n";

class ReadTra : public InAFolder {
 protected:
  shipped::Outputs read(const std::string& text) {
    put(folder / "a.tra", text);
    return shipped::call("read.tra", {}, {{"path", (folder / "a.tra").string()}});
  }
};

TEST_F(ReadTra, AFrameALine) {
  const auto out = read(kQuarter + kLost + kQuarter);
  const auto poses = out.at("poses").as_list<Pose>();
  EXPECT_EQ(poses.names(), (std::vector<std::string>{"0001", "0003"}));
  EXPECT_EQ(poses[1].world_from_model * Vector3d(10, 0, 0), Vector3d(1, 7.5, 300));
  const auto& track = out.at("track").as<AutoscoperTrack>();
  ASSERT_EQ(track.world_from_bone.size(), 3u);
  EXPECT_FALSE(track.world_from_bone[1]);
  // pandas and others write NaN as an empty cell. If such a line were skipped, all later frames would move by one.
  const auto empty = read(kQuarter + std::string(15, ',') + "\n" + kQuarter + "\n");
  EXPECT_EQ(empty.at("poses").as_list<Pose>().names(), (std::vector<std::string>{"0001", "0003"}));
  EXPECT_FALSE(empty.at("track").as<AutoscoperTrack>().world_from_bone.at(1));
}

TEST_F(ReadTra, WhatIsWrittenIsReadBack) {
  List<TrackState> states;
  TrackState state;
  state.now.world_from_model.rotation = rotation_from_vector({0.1, -0.7, 0.3});
  state.now.world_from_model.translation_mm = {1.0 / 3, -200, 1e-7};
  state.measured.emplace();
  states.add("a", state);
  state.measured.reset();
  states.add("b", state);
  write(shipped::call("track.autoscoper", {{"states", shipped::list(states, "frame")}}).at("track"), folder / "b.tra");
  const auto again = read(bytes_of(folder / "b.tra")).at("track").as<AutoscoperTrack>();
  ASSERT_EQ(again.world_from_bone.size(), 2u);
  EXPECT_LT((again.world_from_bone[0]->rotation - state.now.world_from_model.rotation).norm(), 1e-12);
  EXPECT_EQ(again.world_from_bone[0]->translation_mm, state.now.world_from_model.translation_mm);
  EXPECT_FALSE(again.world_from_bone[1]);
}

// With decimal commas a line has more cells, and 16 of them can be another pose.
TEST_F(ReadTra, IsWrittenTheSameUnderAnyLocale) {
  const auto track = read(kQuarter + kLost).at("track");
  const auto written = [&] {
    write(track, folder / "w.tra");
    return bytes_of(folder / "w.tra");
  };
  EXPECT_EQ(written(), kQuarter + kLost);
  MARROW_NEED_COMMA_LOCALE(german);
  EXPECT_EQ(written(), kQuarter + kLost);
}

TEST_F(ReadTra, SaysWhatIsWrong) {
  expect_faults(
      folder / "a.tra", kQuarter,
      {{"", "0,-1,0,1,5,1,0,0,-2,5,0,0,1,300,0,0,0,1\n",
        "/a.tra:1: expected the 16 numbers of a 4x4 matrix, got 18; a number with a decimal comma counts twice: write "
        "12.5, not 12,5"},
       {"", kQuarter + "1,2,3\n", "/a.tra:2: expected the 16 numbers of a 4x4 matrix, got 3"},
       {"-2.5", "x", "/a.tra:1:16: expected a number, got 'x'"},
       {"", "2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n",
        "/a.tra:1: the matrix is no rigid motion; Autoscoper writes 4x4 matrices row by row, with 0, 0, 0, 1 at the "
        "end"},
       {"", kLost, "/a.tra: there is no tracked frame in it"}},
      [](const auto& path) {
        shipped::call("read.tra", {}, {{"path", path.string()}});
      });
}

// ---- JointTrack

const std::string kHeader = "JT_EULER_312\n x_tran, y_tran, z_tran, z_rot, x_rot, y_rot\n";

class ReadJointTrack : public InAFolder {
 protected:
  static List<Pose> read(const std::filesystem::path& path, shipped::Options options = {}) {
    options["path"] = path.string();
    return shipped::call("read.jointtrack", {}, options).at("poses").as_list<Pose>();
  }
  List<Pose> of(const std::string& text, const shipped::Options& options = {}) {
    put(folder / "a.jts", text);
    return read(folder / "a.jts", options);
  }
  RigidTransform first(const std::string& line, const shipped::Options& options = {}) {
    return of(kHeader + line, options)[0].world_from_model;
  }
};

// JointTrack's camera has y up and z towards the source, OpenCV's y down and z away from it.
TEST_F(ReadJointTrack, AQuarterAboutZThenTheAxesOfOpenCv) {
  const RigidTransform pose = first("1, 2, -300, 90, 0, 0\n");
  EXPECT_LT((pose.translation_mm - Vector3d(1, -2, 300)).norm(), 1e-12);
  // x of the model points up in the image, which is -y of OpenCV; y to the left.
  EXPECT_LT((pose.rotation.col(0) - Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_LT((pose.rotation.col(1) - Vector3d(-1, 0, 0)).norm(), 1e-12);
  // Rz Rx Ry: y first: z of the model to x, then x stays, then z turns x to y (up).
  EXPECT_LT((first("0, 0, -300, 90, 0, 90\n").rotation.col(2) - Vector3d(0, -1, 0)).norm(), 1e-12);
}

TEST_F(ReadJointTrack, ColumnsMayBeInRadiansAndTheRotationsAboutOpenCvsAxes) {
  const RigidTransform in_degrees = first("0, 0, -300, 45, 20, 90\n"),
                       mixed = first("0, 0, -300, 0.78539816339744831, 20, 1.5707963267948966\n",
                                     {{"radians", std::vector<std::string>{"z_rot", "y_rot"}}});
  EXPECT_LT((in_degrees.rotation - mixed.rotation).norm(), 1e-12);
  const RigidTransform y_down = first("1, 2, -300, 90, 0, 0\n", {{"rotation_axes", "y_down"}});
  EXPECT_LT((y_down.rotation.col(0) - Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_LT((y_down.translation_mm - Vector3d(1, -2, 300)).norm(), 1e-12);
}

TEST_F(ReadJointTrack, AFrameNotOptimizedHasNoPoseAndMovesNoOther) {
  const auto poses =
      of("JTA_EULER_KINEMATICS\nX_TRAN\tY_TRAN\n1,\t2,\t-300,\t40,\t50,\t60,\nNOT_OPTIMIZED,\t0,\t0,\t0,\t0,\t0,\n"
         "3,\t2,\t-300,\t40,\t50,\t60,\n");
  EXPECT_EQ(poses.names(), (std::vector<std::string>{"0001", "0003"}));
  EXPECT_EQ(poses[1].world_from_model.translation_mm.x(), 3);
}

TEST_F(ReadJointTrack, WhatIsWrittenIsReadBack) {
  List<Pose> poses;
  Pose pose;
  pose.world_from_model.rotation = rotation_from_vector({2.1, -0.7, 0.3});
  pose.world_from_model.translation_mm = {4.5, -20, 1080};
  poses.add("0003", pose);
  const auto written = shipped::call("write.jointtrack", {{"poses", shipped::list(poses, "frame")}});
  for (const char* format : {"jts", "jtak"}) {
    write(written.at(format), folder / "b");
    const auto again = read(folder / "b");
    EXPECT_EQ(again.names(), (std::vector<std::string>{"0003"}));
    EXPECT_LT((again[0].world_from_model.rotation - pose.world_from_model.rotation).norm(), 1e-9) << format;
    EXPECT_LT((again[0].world_from_model.translation_mm - pose.world_from_model.translation_mm).norm(), 1e-7);
  }
}

TEST_F(ReadJointTrack, ACalibrationIsACameraAndOffsetsAreMmWithYUp) {
  put(folder / "calibration.txt", "JT_INTCALIB\n1000\n2\n3\n0.5\n");
  const auto camera =
      read_by<Camera>("read.camera", folder / "calibration.txt", {{"image_size_px", std::vector<double>{101, 201}}});
  Eigen::Matrix3d expected;
  expected << 2000, 0, 54, 0, 2000, 94, 0, 0, 1;
  EXPECT_LT((camera.intrinsics - expected).norm(), 1e-12);
}

TEST_F(ReadJointTrack, NumbersThatLookLikeTheOtherUnitAreDoubted) {
  using Texts = std::vector<std::string>;
  const auto doubts = [&](const std::string& lines, const Texts& radians) {
    put(folder / "a.jts", kHeader + lines);
    Texts said = exchange::read_jointtrack_poses(folder / "a.jts", {radians}).doubts;
    for (std::string& one : said) one = one.substr((folder / "a.jts").string().size() + 2);
    return said;
  };
  const std::string in_degrees = "0, 0, -300, 45, -20, 90\n",
                    in_radians = "0, 0, -300, 1.5, -20, 90\n0, 0, -300, -2.5, -20, 90\n";
  EXPECT_EQ(doubts(in_degrees, {}), Texts{});
  EXPECT_EQ(doubts(in_radians, {"z_rot"}), Texts{});
  EXPECT_EQ(doubts(in_radians, {}),
            Texts{"z_rot was taken in degrees, but is never more than 2.5: either the implant is hardly turned about "
                  "this axis, or these are radians; then give radians=[z_rot]"});
  EXPECT_EQ(doubts(in_degrees, {"x_rot"}),
            Texts{"x_rot was taken in radians, but reaches 20: these look like degrees; leave it out of 'radians'"});
}

TEST_F(ReadJointTrack, SaysWhatIsWrong) {
  expect_faults(
      folder / "a.jts", kHeader + "1, 2, 3, 4, 5, 6\n",
      {{"", "JT_EULER_321\n",
        "/a.jts:1: expected JT_EULER_312 or JTA_EULER_KINEMATICS, got 'JT_EULER_321'; save the kinematics as .jts or "
        ".jtak in JointTrack"},
       {", 4, 5, 6", "", "/a.jts:3: expected 6 numbers (x, y, z in mm; rotations about z, x, y), got 3 words"},
       {"6\n", "nan\n", "/a.jts:3: expected numbers of at most 1e6, got 'nan'"},
       {"", kHeader, "/a.jts: there is no pose in it; each frame has a line of 6 numbers"}},
      [](const auto& path) { read(path); });
}

}  // namespace tracks_test
