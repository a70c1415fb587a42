// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/track/track_state.hpp"
#include "sequences.hpp"
#include "tests/plugins/read/files.hpp"

namespace marrow::test::keyframes_test {

using sequences::six;
using track::AutoscoperTrack;
using track::SequenceFrame;
using track::TrackState;

const std::string kPlaced = "0,-1,0,1,1,0,0,-2.5,0,0,1,300,0,0,0,1\n";
const std::string kNone = "NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN\n";

class TrackKeyframes : public testing::Test {
 protected:
  TrackKeyframes() {
    for (const char* bone : {"femur", "left/tibia"}) bones.add(bone, Pose{});
    for (const char* frame : {"0001", "0002", "0003"}) frames.add(frame, SequenceFrame{});
  }
  Inputs inputs() const {
    return {{"poses", shipped::list(bones, "fragment")}, {"frames", shipped::list(frames, "frame")}};
  }
  List<AutoscoperTrack> read(const std::string& path) const {
    return output_list<AutoscoperTrack>("track.keyframes", "keyframes", inputs(), {{"path", path}});
  }
  /// The message behind the folder's name.
  std::string refusal(const std::string& inside = "") const {
    const std::string said = shipped::refusal("track.keyframes", inputs(), {{"path", (folder / inside).string()}});
    const std::string where = (folder / "").string();
    return said.starts_with(where) ? said.substr(where.size()) : said;
  }
  List<Pose> bones;
  List<SequenceFrame> frames;
  TemporaryFolder folder;
};

TEST_F(TrackKeyframes, AFileForEachBoneThatHasSome) {
  put(folder / "left%2Ftibia.tra", kNone + kPlaced + kNone);
  put(folder / "femur.yaml", "the start of a bone may lie beside it");
  const auto tracks = read(folder.path().string());
  EXPECT_EQ(tracks.names(), (Strings{"femur", "left/tibia"}));
  EXPECT_TRUE(tracks[0].world_from_bone.empty());
  ASSERT_EQ(tracks[1].world_from_bone.size(), 3u);
  EXPECT_FALSE(tracks[1].world_from_bone[0]);
  EXPECT_EQ(*tracks[1].world_from_bone[1] * Vector3d(10, 0, 0), Vector3d(1, 7.5, 300));
}

TEST_F(TrackKeyframes, NoFolderMeansNone) {
  for (const auto& track : read("")) EXPECT_TRUE(track.world_from_bone.empty());
}

TEST_F(TrackKeyframes, SaysWhatIsWrong) {
  put(folder / "femur.tra", kNone + kPlaced);
  EXPECT_EQ(refusal(),
            "femur.tra: has 2 lines, but the sequence has 3 frames; it needs a line for each frame that is read, with "
            "NaN where there is no keyframe");
  put(folder / "femur.tra", kNone + "1,0,0,5,0,1,0,six,0,0,1,0,0,0,0,1\n" + kNone);
  EXPECT_EQ(refusal(), "femur.tra:2:15: expected a number, got 'six'");
  put(folder / "femur.tra", kNone + "1,0,0,5,0,1,0,6,0,0,-1,0,0,0,0,1\n" + kNone);
  EXPECT_EQ(refusal(),
            "femur.tra:2: the matrix is no rigid motion; Autoscoper writes 4x4 matrices row by row, with 0, 0, 0, 1 at "
            "the end");
  put(folder / "femur.tra", kNone + kNone + kNone);
  put(folder / "tibia.tra", kNone + kNone + kNone);
  EXPECT_EQ(refusal(),
            "tibia.tra: no bone of this name is followed; name the file after its bone, which is one of 'femur', "
            "'left/tibia'");
  EXPECT_EQ(refusal("femur.tra"),
            "femur.tra: expected a folder with a file BONE.tra for each bone that has keyframes (name the folder, not "
            "a file in it)");
  EXPECT_EQ(
      refusal("nowhere"),
      "nowhere: expected a folder with a file BONE.tra for each bone that has keyframes; there is no such folder");
  std::filesystem::create_directory(folder / "empty");
  EXPECT_EQ(
      refusal("empty"),
      "empty: there is no .tra file in it; a file of keyframes is named after its bone, one of 'femur', 'left/tibia'");
}

class TrackPredict : public testing::Test {
 protected:
  TrackPredict() {
    state.now.velocity_per_s = six(30, 0, 0, 60, 0, 0);
    state.now.covariance(0, 6) = state.now.covariance(6, 0) = 1e-3;
  }
  Outputs predicted(const AutoscoperTrack* keyframes, const Options& options = {}) const {
    Inputs inputs{{"state", item(state)}};
    if (keyframes) inputs["keyframes"] = item(*keyframes);
    return call("track.predict", inputs, options);
  }
  TrackState state = sequences::begin();
  const RigidTransform keyframe = placed({1, -200, 3}, {0.1, -0.7, 0.3});
};

TEST_F(TrackPredict, AKeyframeTakesThePlaceOfThePrediction) {
  const AutoscoperTrack keyframes{{keyframe, std::nullopt}};
  const auto out = predicted(
      &keyframes,
      {{"keyframe_deg", 2.0}, {"keyframe_mm", 4.0}, {"keyframe_speed_deg_s", 50.0}, {"keyframe_speed_mm_s", 70.0}});
  const TrackState next = out.at("state").as<TrackState>();
  const Pose pose = out.at("pose").as<Pose>();
  EXPECT_EQ(pose.world_from_model.translation_mm, keyframe.translation_mm);
  EXPECT_EQ(pose.world_from_model.rotation, keyframe.rotation);
  EXPECT_EQ(pose.frame.origin_mm, state.fragment.origin_mm);
  EXPECT_EQ(next.predicted.world_from_model.rotation, keyframe.rotation);
  EXPECT_EQ(next.now.velocity_per_s, Vector6d(Vector6d::Zero())) << "the frames before were wrong";
  track::Vector12d deviation;
  deviation << six(2, 2, 2, 4, 4, 4), six(50, 50, 50, 70, 70, 70);
  EXPECT_LT((next.now.covariance - track::Matrix12d(deviation.cwiseAbs2().asDiagonal())).norm(), 1e-9);
  EXPECT_EQ(next.frame, 0);
  EXPECT_FALSE(next.is_found());
}

TEST_F(TrackPredict, OnlyTheVelocityIsKeptAndOnlyIfItLedToTheKeyframe) {
  state.usual_cost = 0.3;
  state.noise_scale = 5;
  state.usual_covariance = Matrix6d(Matrix6d::Identity());
  const RigidTransform expected = predicted(nullptr).at("pose").as<Pose>().world_from_model;
  const auto state_at = [&](const Vector6d& from_prediction) {
    const AutoscoperTrack keyframes{{moved(expected, state.fragment, from_prediction)}};
    return predicted(&keyframes).at("state").as<TrackState>();
  };
  const TrackState near = state_at(six(2, 1, -2, 3, -2, 1)), far = state_at(six(0, 0, 0, 80, 0, 0));
  EXPECT_EQ(near.now.velocity_per_s, state.now.velocity_per_s);
  EXPECT_EQ(far.now.velocity_per_s, Vector6d(Vector6d::Zero()));
  for (const TrackState& one : {near, far}) {
    EXPECT_TRUE(std::isnan(one.usual_cost));
    EXPECT_EQ(one.noise_scale, 1);
    EXPECT_FALSE(one.usual_covariance);
  }
}

TEST_F(TrackPredict, WithoutAKeyframeInTheFrameItIsAsBefore) {
  const AutoscoperTrack in_another{{std::nullopt, keyframe}}, none;
  const TrackState before = predicted(nullptr).at("state").as<TrackState>();
  EXPECT_NE(before.now.world_from_model.translation_mm, state.now.world_from_model.translation_mm);
  for (const AutoscoperTrack* keyframes : {&in_another, &none}) {
    const TrackState now = predicted(keyframes).at("state").as<TrackState>();
    EXPECT_EQ(now.now.world_from_model.translation_mm, before.now.world_from_model.translation_mm);
    EXPECT_EQ(now.now.world_from_model.rotation, before.now.world_from_model.rotation);
    EXPECT_EQ(now.now.covariance, before.now.covariance);
  }
}

TEST_F(TrackPredict, RefusesAFrameBehindTheLastLine) {
  const AutoscoperTrack keyframes{{keyframe, std::nullopt}};
  state.frame = 1;
  EXPECT_EQ(shipped::refusal("track.predict", {{"state", item(state)}, {"keyframes", item(keyframes)}}),
            "there are keyframes for 2 frames, but this is frame 3; give a line for each frame, with NaN where there "
            "is no keyframe");
}

// A bone that jumps, as after a gap in the recording: without a keyframe it stays lost, with one it is found at once.
TEST_F(TrackPredict, AKeyframeFindsALostBoneAgain) {
  const Vector6d noise = six(0.05, 0.05, 0.2, 0.05, 0.05, 0.1);
  Random random(1, 1);
  const auto found_at_jump = [&](bool has_keyframe) {
    TrackState now = sequences::begin();
    RigidTransform truth = now.now.world_from_model;
    AutoscoperTrack keyframes{std::vector<std::optional<RigidTransform>>(8)};
    for (int frame = 0; frame < 8; ++frame) {
      if (frame == 6) truth = moved(truth, now.fragment, six(60, 0, 0, 80, 0, 0));
      if (frame == 6 && has_keyframe)
        keyframes.world_from_bone[6] = moved(truth, now.fragment, six(2, -2, 1, 2, 1, -2));
      now = output<TrackState>("track.predict", "state", {{"state", item(now)}, {"keyframes", item(keyframes)}});
      const auto measured = sequences::measured(truth, now, noise, random);
      Pose pose = pose_of(measured.world_from_model);
      pose.frame = now.fragment;
      pose.covariance = measured.covariance;
      pose.cost = 0.2;
      now = output<TrackState>("track.filter", "state", {{"state", item(now)}, {"pose", item(pose)}});
      if (frame == 6) break;
    }
    return now.is_found();
  };
  EXPECT_FALSE(found_at_jump(false));
  EXPECT_TRUE(found_at_jump(true));
}

}  // namespace marrow::test::keyframes_test
