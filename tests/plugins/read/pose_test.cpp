// SPDX-License-Identifier: Apache-2.0
// Poses in files of other programs: Autoscoper's .tra, and JointTrack's poses and calibration, against rotations that
// are known by hand.
#include <yaml-cpp/yaml.h>

#include "marrow/toolbox/exchange/jointtrack.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/toolbox/track/track_state.hpp"
#include "tests/harness/comma_locale.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/reading.hpp"
#include "tests/plugins/write/writing.hpp"

namespace pose_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Matrix3d;

Pose pose_at(const std::filesystem::path& path) { return read_by<Pose>("read.pose", path); }

using ReadPose = InAFolder;
using track::AutoscoperTrack, track::TrackState;

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
TEST_F(ReadJointTrack, AQuarterAboutZThenTheAxesOfOpenCvAndColumnsInRadians) {
  const RigidTransform pose = first("1, 2, -300, 90, 0, 0\n");
  EXPECT_LT((pose.translation_mm - Vector3d(1, -2, 300)).norm(), 1e-12);
  // x of the model points up in the image, which is -y of OpenCV; y to the left.
  EXPECT_LT((pose.rotation.col(0) - Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_LT((pose.rotation.col(1) - Vector3d(-1, 0, 0)).norm(), 1e-12);
  // Rz Rx Ry: y first: z of the model to x, then x stays, then z turns x to y (up).
  EXPECT_LT((first("0, 0, -300, 90, 0, 90\n").rotation.col(2) - Vector3d(0, -1, 0)).norm(), 1e-12);
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

}  // namespace pose_test
