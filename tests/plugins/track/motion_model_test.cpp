// SPDX-License-Identifier: Apache-2.0
#include "sequences.hpp"

namespace marrow::test::motion_model_test {

using sequences::six;
using track::Measurement;
using track::TrackState;
using track::Vector12d;

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

}  // namespace marrow::test::motion_model_test
