// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>

#include "sequences.hpp"

namespace marrow::test::smooth_test {

using sequences::six;
using track::TrackState;

std::vector<TrackState> filtered(TrackState state, const std::vector<RigidTransform>& way, const Vector6d& noise,
                                 std::uint64_t seed) {
  Random random(seed, 1);
  std::vector<TrackState> states;
  for (const RigidTransform& truth : way) {
    state = track::predicted(state);
    state = track::updated(state, sequences::measured(truth, state, noise, random));
    states.push_back(state);
  }
  return states;
}

/// Root mean square of the error about the long axis.
double axial_rms(const std::vector<TrackState>& states, const std::vector<RigidTransform>& way) {
  double sum = 0;
  for (std::size_t i = 0; i < way.size(); ++i)
    sum += std::pow(motion_between(way[i], states[i].now.world_from_model, states[i].fragment)[2], 2);
  return std::sqrt(sum / double(way.size()));
}

TEST(Smooth, LowersTheErrorOfASteadyMotion) {
  const Vector6d noise = six(0.05, 0.05, 0.3, 0.05, 0.05, 0.1);
  const TrackState begin = sequences::begin({{"frame_rate_hz", 62.0}});
  const auto way = sequences::way(begin, six(120, -60, 30, 100, -150, 50), 100);
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto states = filtered(begin, way, noise, seed);
    EXPECT_LT(axial_rms(track::smoothed(states), way), 0.5 * axial_rms(states, way)) << seed;
  }
}

TEST(Smooth, DoesNotRelyOnTheCovariancesOfTheRegistration) {
  // A forearm that turns to and fro. The covariances are ten or a tenth of what they should be.
  const Vector6d noise = six(0.05, 0.05, 0.3, 0.05, 0.05, 0.1);
  for (const double wrong : {0.1, 1.0, 10.0}) {
    TrackState state = sequences::begin({{"frame_rate_hz", 62.0}});
    Random random(5, 1);
    std::vector<TrackState> states;
    std::vector<RigidTransform> way;
    for (int i = 0; i < 100; ++i) {
      const double phase = 2 * kPi * i / 62 / 0.8;
      way.push_back(moved(sequences::begin().now.world_from_model, state.fragment,
                          (1 - std::cos(phase)) * six(2, 1, 5, 1, 2, 3)));
      track::Measurement measured = sequences::measured(way.back(), state, noise, random);
      measured.covariance *= wrong;
      state = track::updated(track::predicted(state), measured);
      states.push_back(state);
    }
    EXPECT_LT(axial_rms(track::smoothed(states), way), 0.6 * radians(0.3)) << wrong;
  }
}

TEST(Smooth, IsTheLeastSquaresSolution) {
  // Shifts along one axis are a linear problem. It is solved here with all positions and velocities as unknowns.
  constexpr int kFrames = 12;
  const double rate = 10, dt = 1 / rate, noise = 0.5;
  TrackState begin = sequences::begin({{"frame_rate_hz", rate}, {"acceleration_mm_s2", 40.0}});
  const auto way = sequences::way(begin, six(0, 0, 0, 0, 0, 20), kFrames);
  const auto states = filtered(begin, way, six(1e-7, 1e-7, 1e-7, noise, noise, noise), 4);
  const auto smoothed = track::smoothed(states);
  const double acceleration = smoothed[0].acceleration_per_s2[5];
  const auto along = [&](const RigidTransform& pose) { return motion_between(way[0], pose, begin.fragment)[5]; };
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(2 * kFrames, 2 * kFrames);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(2 * kFrames);
  const auto add = [&](const Eigen::RowVectorXd& row, double value, double deviation) {
    normal += row.transpose() * row / (deviation * deviation);
    right += row.transpose() * value / (deviation * deviation);
  };
  // The first frame as the filter left it, the others by their measurements.
  const Eigen::Matrix2d prior = (Eigen::Matrix2d() << states[0].now.covariance(5, 5), states[0].now.covariance(5, 11),
                                 states[0].now.covariance(11, 5), states[0].now.covariance(11, 11))
                                    .finished()
                                    .inverse();
  normal.topLeftCorner<2, 2>() += prior;
  right.head<2>() += prior * Vector2d(along(states[0].now.world_from_model), states[0].now.velocity_per_s[5]);
  for (int i = 0; i < kFrames; ++i) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(2 * kFrames);
    if (i > 0) {
      row[2 * i] = 1;
      add(row, along(states[std::size_t(i)].measured->world_from_model), noise);
    }
    if (i + 1 == kFrames) break;
    // A white acceleration changes the velocity, and the position by half as much times dt. What it adds to that has
    // the variance (a dt^2)^2 / 12 and does not depend on the velocity: 1/4 and 1/12 make the 1/3 of white noise.
    row.setZero();
    row[2 * i + 3] = 1, row[2 * i + 1] = -1;
    add(row, 0, acceleration * dt);
    row.setZero();
    row[2 * i + 2] = 1, row[2 * i] = -1, row[2 * i + 1] = -0.5 * dt, row[2 * i + 3] = -0.5 * dt;
    add(row, 0, acceleration * dt * dt / std::sqrt(12));
  }
  const Eigen::VectorXd best = normal.ldlt().solve(right);
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_NEAR(along(smoothed[std::size_t(i)].now.world_from_model), best[2 * i], 1e-3) << i;
    EXPECT_NEAR(smoothed[std::size_t(i)].now.velocity_per_s[5], best[2 * i + 1], 2e-2) << i;
  }
}

TEST(Smooth, FramesMustFollowEachOther) {
  const TrackState begin = sequences::begin();
  auto states = filtered(begin, sequences::way(begin, Vector6d::Zero(), 3), six(1, 1, 1, 1, 1, 1), 1);
  states.erase(states.begin() + 1);
  EXPECT_EQ(message_of([&] { track::smoothed(states); }),
            "the frames to smooth do not follow each other: frame 2 stands where frame 1 is expected");
}

}  // namespace marrow::test::smooth_test
