// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/track/track_state.hpp"
#include "sequences.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::filter_test {

using sequences::six;
using track::TrackState;

const Vector6d kNoise = six(0.05, 0.05, 0.2, 0.05, 0.05, 0.1);

Pose pose_at(const RigidTransform& world_from_model, const TrackState& state, double cost = 0.2) {
  Pose pose = pose_of(world_from_model);
  pose.frame = state.fragment;
  pose.covariance = Matrix6d(kNoise.cwiseAbs2().asDiagonal());
  pose.cost = cost;
  return pose;
}

Outputs filtered(const TrackState& state, const Pose* pose, const Verdict* verdict = nullptr,
                 const Options& options = {}) {
  Inputs inputs{{"state", item(state)}};
  if (pose) inputs["pose"] = item(*pose);
  if (verdict) inputs["verdict"] = item(*verdict);
  return call("track.filter", inputs, options);
}

TrackState state_of(const Outputs& outputs) { return outputs.at("state").as<TrackState>(); }

TEST(TrackFilter, FollowsABoneWithinItsDeviations) {
  TrackState state = sequences::begin({{"frame_rate_hz", 62.0}});
  Random random(1, 1);
  RigidTransform truth = state.now.world_from_model;
  Vector6d velocity = six(120, -60, 90, 100, -150, 50);
  double surprises = 0, squares = 0;
  constexpr int kFrames = 400;
  for (int i = 0; i < kFrames; ++i) {
    state = track::predicted(state);
    const auto measured = sequences::measured(truth, state, kNoise, random);
    const Pose pose = pose_at(measured.world_from_model, state);
    // Of 400 right poses, some lie beyond the gate by chance. They count here, too.
    state = state_of(filtered(state, &pose, nullptr, {{"gate", 1e9}, {"first_scale", 1.0}}));
    surprises += state.surprise / kFrames;
    const Vector6d error = motion_between(truth, state.now.world_from_model, state.fragment);
    squares += error.dot(state.now.covariance.topLeftCorner<6, 6>().inverse() * error) / kFrames;
    // White acceleration: its mean over the frame moves the bone as if it were constant, the rest has the variance
    // (a dt^2)^2 / 12 and leaves the velocity as it is.
    const double dt = 1 / state.frame_rate_hz;
    Vector6d mean, rest;
    for (int k = 0; k < 6; ++k) {
      mean[k] = state.acceleration_per_s2[k] * random.normal();
      rest[k] = state.acceleration_per_s2[k] * random.normal() / std::sqrt(12);
    }
    truth = moved(truth, state.fragment, velocity * dt + dt * dt * (0.5 * mean + rest));
    velocity += dt * mean;
  }
  // Chi-squared with 6 degrees of freedom; a little less, because the scale of the noise is never below 1.
  EXPECT_NEAR(surprises, 5.5, 1);
  EXPECT_NEAR(squares, 5, 1);
}

TEST(TrackFilter, SaysWhyABoneIsLost) {
  TrackState state = track::predicted(sequences::begin());
  state.usual_cost = 0.2;
  const RigidTransform there = state.predicted.world_from_model;
  const auto note = [&](const Pose* pose, const Verdict* verdict = nullptr) {
    return state_of(filtered(state, pose, verdict)).note;
  };
  Pose good = pose_at(there, state);
  EXPECT_EQ(note(&good), "");
  EXPECT_EQ(note(nullptr), "no pose was found");
  Pose without = good;
  without.covariance.reset();
  EXPECT_EQ(note(&without), "the images do not determine the pose");
  const Pose dear = pose_at(there, state, 0.5);
  EXPECT_EQ(note(&dear), "its cost is 0.5, where 0.2 is usual");
  const Pose far = pose_at(moved(there, state.fragment, six(0, 0, 60, 0, 0, 0)), state);
  EXPECT_EQ(note(&far).substr(0, 54), "it is not where the motion leads: squared distance 165");
  Verdict wrong;
  wrong.judgement = Judgement::wrong;
  wrong.reasons = {"the shaft is too wide"};
  EXPECT_EQ(note(&good, &wrong), "its verdict is wrong: the shaft is too wide");
}

TEST(TrackFilter, TheUsualCostFollowsOneThatGrowsSlowly) {
  // As when a joint bends and its bones begin to overlap: four times as much after ten frames, but never a jump.
  TrackState state = sequences::begin();
  double cost = 0.02;
  for (int i = 0; i < 20; ++i, cost *= 1.15) {
    state = track::predicted(state);
    const Pose pose = pose_at(state.predicted.world_from_model, state, cost);
    state = state_of(filtered(state, &pose));
    EXPECT_TRUE(state.is_found()) << i << ": " << state.note;
  }
}

TEST(TrackFilter, ALostBoneIsWhereItsMotionLeads) {
  TrackState state = track::predicted(sequences::begin());
  const Outputs outputs = filtered(state, nullptr);
  const TrackState lost = state_of(outputs);
  EXPECT_FALSE(lost.is_found());
  EXPECT_EQ(lost.frames_lost, 1);
  EXPECT_EQ(lost.now.world_from_model.rotation, state.predicted.world_from_model.rotation);
  EXPECT_EQ(outputs.at("pose").as<Pose>().warnings, (Strings{"no pose was found"}));
  const TrackState again = state_of(filtered(track::predicted(lost), nullptr));
  EXPECT_EQ(again.frames_lost, 2);
  EXPECT_GT(again.now.covariance(2, 2), lost.now.covariance(2, 2));
  const TrackState next = track::predicted(again);
  const Pose found = pose_at(next.predicted.world_from_model, next);
  EXPECT_EQ(state_of(filtered(next, &found)).frames_lost, 0);
}

TEST(TrackFilter, APoseThatIsKnownExactlyIsNone) {
  // No registration knows a pose exactly: such a covariance comes from a cost that is the same everywhere.
  const TrackState state = track::predicted(sequences::begin());
  Pose exact = pose_at(state.predicted.world_from_model, state);
  exact.covariance->setZero();
  const TrackState after = state_of(filtered(state, &exact));
  EXPECT_FALSE(after.is_found());
  EXPECT_EQ(after.note, "its predicted deviations are 0, so its registration compared nothing");
  EXPECT_FALSE(after.usual_covariance);
}

TEST(TrackFilter, APoseWithoutDeviationsThatCanBeWeighedIsNone) {
  const TrackState state = track::predicted(sequences::begin());
  const auto note = [&](const Matrix6d& covariance) {
    Pose pose = pose_at(state.predicted.world_from_model, state);
    pose.covariance = covariance;
    const TrackState after = state_of(filtered(state, &pose));
    EXPECT_FALSE(after.is_found());
    EXPECT_FALSE(after.usual_covariance);
    return after.note;
  };
  Matrix6d right = kNoise.cwiseAbs2().asDiagonal(), flat = right, open = right;
  flat.row(5).setZero(), flat.col(5).setZero();
  EXPECT_EQ(note(flat), "its predicted deviation is 0 in one direction, which no image tells exactly");
  EXPECT_EQ(note(1e-14 * Matrix6d::Identity()),
            "its predicted deviation is 0 in one direction, which no image tells exactly");
  open(2, 2) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(note(open), "the images do not determine the pose");
}

TEST(TrackFilter, ACovarianceInOtherAxesIsTurned) {
  // The same knowledge about other axes: what is loose along x there is loose along y here.
  const TrackState state = track::predicted(sequences::begin());
  Pose pose = pose_at(state.predicted.world_from_model, state);
  const Pose same = in_frame(pose, {state.fragment.origin_mm + Vector3d(40, -30, 20),
                                    state.fragment.axes * rotation_from_vector({0, 0, kPi / 2})});
  const Matrix6d expected = state_of(filtered(state, &pose)).now.covariance.topLeftCorner<6, 6>(),
                 found = state_of(filtered(state, &same)).now.covariance.topLeftCorner<6, 6>();
  EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm());
}

TEST(TrackBegin, TheModelGivesTheAxesOfAStartThatHasNone) {
  Heard listener;
  const Mesh mesh = shapes::cylinder(12, 120);
  Inputs inputs{{"start", item(Pose())}, {"model", item(mesh)}};
  const auto state = output<TrackState>("track.begin", "state", inputs, {}, listener.context);
  EXPECT_TRUE(state.fragment.is_anatomical);
  EXPECT_LT((state.fragment.origin_mm - fragment_frame(mesh).origin_mm).norm(), 1e-9);
  EXPECT_TRUE(listener.warnings.empty());
}

TEST(TrackBegin, SaysThatAStartHasNoAxes) {
  Heard listener;
  const Inputs inputs{{"start", item(Pose())}};
  EXPECT_FALSE(output<TrackState>("track.begin", "state", inputs, {}, listener.context).fragment.is_anatomical);
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_TRUE(listener.warnings[0].starts_with("the start has no axes of the bone, and no model gives them: "));
}

using track::Measurement, track::Vector12d;

TEST(MotionModel, ABoneKeepsItsVelocity) {
  TrackState state = sequences::begin({{"frame_rate_hz", 50.0}});
  state.now.velocity_per_s = six(100, -200, 300, 40, 50, -60);
  const TrackState next = track::predicted(state);
  EXPECT_EQ(next.frame, 0);
  EXPECT_EQ(next.now.velocity_per_s, state.now.velocity_per_s);
  const Vector6d moved = motion_between(state.now.world_from_model, next.now.world_from_model, state.fragment);
  EXPECT_LT((moved - six(2, -4, 6, 0.8, 1, -1.2)).norm(), 1e-9);
}

TEST(MotionModel, ErrorsGoOnAsTheMotionCarriesThem) {
  // The covariance of a state with one known error, against that error in a moved bone.
  TrackState state =
      sequences::begin({{"frame_rate_hz", 50.0}, {"acceleration_deg_s2", 1e-6}, {"acceleration_mm_s2", 1e-6}});
  state.now.velocity_per_s = six(100, -200, 300, 40, 50, -60);
  for (int k = 0; k < 12; ++k) {
    constexpr double kSmall = 1e-5;
    Vector12d error = Vector12d::Zero();
    error[k] = kSmall;
    TrackState off = state;
    off.now.world_from_model = moved(state.now.world_from_model, state.fragment, error.head<6>());
    off.now.velocity_per_s += error.tail<6>();
    state.now.covariance = error * error.transpose();
    const TrackState next = track::predicted(state), next_off = track::predicted(off);
    Vector12d expected;
    expected << motion_between(next.now.world_from_model, next_off.now.world_from_model, state.fragment),
        next_off.now.velocity_per_s - next.now.velocity_per_s;
    for (int i = 0; i < 12; ++i)
      EXPECT_NEAR(std::sqrt(next.now.covariance(i, i)) / kSmall, std::abs(expected[i]) / kSmall, 3e-3) << k << " " << i;
  }
}

TEST(MotionModel, AWhiteAccelerationAddsItsExactCovariance) {
  // The integral of (s, 1) (s, 1)^T over the frame times a^2 dt: a^2 (dt^4 / 3, dt^3 / 2; dt^3 / 2, dt^2).
  TrackState state =
      sequences::begin({{"frame_rate_hz", 10.0}, {"acceleration_deg_s2", 90.0}, {"acceleration_mm_s2", 70.0}});
  state.now.covariance.setZero();
  const TrackState next = track::predicted(state);
  EXPECT_NEAR(std::sqrt(next.now.covariance(2, 2)), radians(0.9 / std::sqrt(3)), 1e-12);
  EXPECT_NEAR(std::sqrt(next.now.covariance(5, 5)), 0.7 / std::sqrt(3), 1e-12);
  EXPECT_NEAR(next.now.covariance(5, 11), 70 * 70 * 0.001 / 2, 1e-12);
  EXPECT_NEAR(std::sqrt(next.now.covariance(8, 8)), radians(9), 1e-12);
  EXPECT_NEAR(std::sqrt(next.now.covariance(11, 11)), 7, 1e-12);
}

TEST(MotionModel, AMeasurementIsWeighedByItsCovariance) {
  TrackState state = track::predicted(sequences::begin());
  state.predicted.covariance.setIdentity();
  state.predicted.covariance *= 4;
  const Vector6d off = six(0, 0, 0, 5, 0, 0);
  Measurement measured{moved(state.predicted.world_from_model, state.fragment, off), Matrix6d::Identity()};
  EXPECT_NEAR(track::surprise(state, measured), 5, 1e-9) << "25 / (4 + 1)";
  const TrackState next = track::updated(state, measured);
  const Vector6d way = motion_between(state.predicted.world_from_model, next.now.world_from_model, state.fragment);
  EXPECT_NEAR(way[3], 4, 1e-9) << "4 / (4 + 1) of the way";
  EXPECT_NEAR(next.now.covariance(3, 3), 0.8, 1e-9);
  EXPECT_NEAR(next.surprise, 5, 1e-9);
}

}  // namespace marrow::test::filter_test
