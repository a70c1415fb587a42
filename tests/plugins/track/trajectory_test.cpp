// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <sstream>

#include "tests/harness/comma_locale.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/track/sequences.hpp"
#include "tests/plugins/write/writing.hpp"

namespace marrow::test::trajectory_test {

using track::TrackState;
using track::Trajectory;

/// The cells of each line, without quotes: no cell of these has a comma.
std::vector<Strings> table_of(const Trajectory& trajectory) {
  const TemporaryFolder folder;
  writing::write(trajectory, folder / "way.csv");
  std::istringstream lines(bytes_of(folder / "way.csv"));
  std::vector<Strings> table;
  for (std::string line; std::getline(lines, line);) {
    std::erase(line, '"');
    std::istringstream row(line + ",");
    table.emplace_back();
    for (std::string cell; std::getline(row, cell, ',');) table.back().push_back(cell);
  }
  return table;
}

List<Verdict> verdicts_of_frames(int count) {
  List<Verdict> verdicts;
  for (int i = 0; i < count; ++i) {
    Verdict verdict;
    verdict.judgement = i == 1 ? Judgement::doubtful : Judgement::trusted;
    verdict.failure_probability = i == 1 ? 0.25 : 0;
    verdicts.add("000" + std::to_string(i + 1), verdict);
  }
  return verdicts;
}

/// Three frames at 10 Hz: 2 degrees about and 3 mm along the long axis in each; the second one lost.
Trajectory three_frames(int verdicts = 3) {
  const TrackState begin = sequences::begin({{"frame_rate_hz", 10.0}});
  const auto poses = sequences::way(begin, sequences::six(0, 0, 20, 0, 0, 30), 3);
  List<TrackState> states;
  for (int i = 0; i < 3; ++i) {
    TrackState state = begin;
    state.frame = i;
    state.now.world_from_model = poses[std::size_t(i)];
    state.now.covariance.setIdentity();
    state.now.covariance *= 0.01;
    if (i != 1) state.measured.emplace();
    if (i == 1) state.note = "no edges";
    states.add("000" + std::to_string(i + 1), state);
  }
  return output<Trajectory>(
      "track.trajectory", "trajectory",
      {{"states", shipped::list(states, "frame")}, {"verdicts", shipped::list(verdicts_of_frames(verdicts), "frame")}});
}

TEST(Trajectory, TableIsTheSameUnderAnyLocale) {
  const Trajectory trajectory = three_frames();
  const auto before = table_of(trajectory);
  MARROW_NEED_COMMA_LOCALE(german);
  EXPECT_EQ(table_of(trajectory), before);
}

TEST(Trajectory, TableOfTimeMotionAndDeviations) {
  const auto table = table_of(three_frames());
  ASSERT_EQ(table.size(), 4u);
  const auto cell = [&](std::size_t row, const std::string& title) {
    const auto at = std::find(table[0].begin(), table[0].end(), title);
    EXPECT_NE(at, table[0].end()) << title;
    return at == table[0].end() ? std::string() : table[row].at(std::size_t(at - table[0].begin()));
  };
  EXPECT_EQ(cell(3, "name"), "0003");
  EXPECT_NEAR(std::stod(cell(3, "time_s")), 0.2, 1e-9);
  EXPECT_EQ(cell(1, "found") + cell(2, "found") + cell(3, "found"), "101");
  EXPECT_EQ(cell(2, "note"), "no edges");
  EXPECT_NEAR(std::stod(cell(3, "axial_deg")), 4, 1e-6);
  EXPECT_NEAR(std::stod(cell(3, "along_mm")), 6, 1e-6);
  EXPECT_NEAR(std::stod(cell(3, "frontal_mm")), 0, 1e-6);
  EXPECT_NEAR(std::stod(cell(1, "axial_deg")), 0, 1e-9) << "motion from the first frame";
  EXPECT_NEAR(std::stod(cell(2, "deviation_axial_deg")), degrees(0.1), 1e-6);
  EXPECT_NEAR(std::stod(cell(2, "deviation_along_mm")), 0.1, 1e-9);
  EXPECT_NEAR(std::stod(cell(1, "m14_mm")), 10, 1e-9);
  EXPECT_EQ(cell(1, "verdict") + " " + cell(2, "verdict"), "trusted doubtful");
  EXPECT_NEAR(std::stod(cell(2, "failure_probability")), 0.25, 1e-9);
}

TEST(Trajectory, VerdictsOfOtherFramesAreRefused) {
  EXPECT_EQ(message_of([&] { three_frames(2); }),
            "the verdicts are of other frames than the states: 2 and 3; wire both to the same repetition");
}

}  // namespace marrow::test::trajectory_test

namespace marrow::test::joint_test {

using track::TrackState;

RigidTransform turned(const Vector3d& rotation_deg, const Vector3d& shift_mm = {0, 0, 0}) {
  return placed(shift_mm, rotation_deg * radians(1));
}

List<TrackState> states(const std::vector<RigidTransform>& poses) {
  List<TrackState> list;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    TrackState state;
    state.now.world_from_model = poses[i];
    list.add(std::to_string(i + 1), state);
  }
  return list;
}

std::vector<Value> motion(const std::vector<RigidTransform>& proximal, const std::vector<RigidTransform>& distal,
                          const Options& options = {}) {
  return call("track.joint",
              {{"proximal", shipped::list(states(proximal), "frame")},
               {"distal", shipped::list(states(distal), "frame")}},
              options)
      .at("metrics")
      .items;
}

// In the CT, +x is the patient's left, +y the back, +z up.
TEST(Joint, AFlexedKneeBringsTheFootBack) {
  // About the left: the lower leg, which hangs down, moves to the back.
  const auto found = motion({turned({0, 0, 0})}, {turned({30, 0, 0})});
  EXPECT_NEAR(figure(found[0], "flexion_deg"), 30, 1e-9);
  EXPECT_NEAR(figure(found[0], "adduction_deg"), 0, 1e-9);
  EXPECT_NEAR(figure(found[0], "internal_rotation_deg"), 0, 1e-9);
}

TEST(Joint, EachAngleByItself) {
  // A right shin turns its front to the left: inward, about the upward axis.
  EXPECT_NEAR(figure(motion({turned({0, 0, 0})}, {turned({0, 0, 12})})[0], "internal_rotation_deg"), 12, 1e-9);
  // The lower end of a right shin moves to the left, toward the other leg: its upper end points to the right.
  EXPECT_NEAR(figure(motion({turned({0, 0, 0})}, {turned({0, -7, 0})})[0], "adduction_deg"), 7, 1e-9);
}

TEST(Joint, OnlyTheMotionBetweenTheBonesCounts) {
  const RigidTransform both{"world", "world", rotation_from_vector({0.4, -0.9, 0.2}), {30, -10, 5}};
  const auto alone = motion({turned({0, 0, 0})}, {turned({20, 5, -8}, {1, 2, 3})});
  const auto moved = motion({both * turned({0, 0, 0})}, {both * turned({20, 5, -8}, {1, 2, 3})});
  for (const Metric& metric : alone[0].as<Metrics>().items)
    EXPECT_NEAR(figure(moved[0], metric.name), metric.value, 1e-6) << metric.name;
}

TEST(Joint, ShiftsAreThoseOfTheCentre) {
  const auto found =
      motion({turned({0, 0, 0})}, {turned({0, 0, 0}, {-2, -3, -4})}, {{"centre_mm", Numbers{10, 20, 30}}});
  EXPECT_NEAR(figure(found[0], "right_mm"), 2, 1e-9);
  EXPECT_NEAR(figure(found[0], "front_mm"), 3, 1e-9);
  EXPECT_NEAR(figure(found[0], "distraction_mm"), 4, 1e-9);
}

TEST(Joint, TheHelicalAxisSinceTheFirstFrame) {
  // A screw: 40 degrees about and 6 mm along the upward axis.
  const auto found = motion({turned({0, 0, 0}), turned({0, 0, 0})}, {turned({10, 0, 0}), turned({10, 0, 0})});
  EXPECT_NEAR(figure(found[1], "helical_deg"), 0, 1e-6);
  const auto screw = motion({turned({0, 0, 0}), turned({0, 0, 0})}, {turned({0, 0, 5}), turned({0, 0, 45}, {0, 0, 6})});
  EXPECT_NEAR(figure(screw[1], "helical_deg"), 40, 1e-9);
  EXPECT_NEAR(figure(screw[1], "helical_shift_mm"), 6, 1e-9);
}

TEST(Joint, SaysWhatDoesNotFit) {
  const auto refusal = [](const Options& options, std::size_t frames) {
    return shipped::refusal("track.joint",
                            {{"proximal", shipped::list(states({turned({0, 0, 0})}), "frame")},
                             {"distal", shipped::list(states(std::vector(frames, turned({0, 0, 0}))), "frame")}},
                            options);
  };
  EXPECT_EQ(refusal({}, 2), "the two bones are not followed through the same frames: there are 1 and 2");
  EXPECT_EQ(refusal({{"up", Numbers{2, 0, 0}}}, 1), "'right' and 'up' must be two different directions of the CT");
}

}  // namespace marrow::test::joint_test

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
