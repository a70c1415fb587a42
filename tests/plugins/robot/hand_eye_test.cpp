// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/robotics/hand_eye.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/guide/servo.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::hand_eye_test {

using robot::Move, robot::Station;

// Hand-eye calibration against motions that are made with a known transform.

const RigidTransform kTrue{"robot", "reference", rotation_from_vector({1.1, -2, 0.7}), {120, -40, 300}};
const Vector3d kCentre(5, -8, 90);

Vector6d motion(Vector3d turn_deg, Vector3d shift_mm) {
  Vector6d result;
  result << turn_deg * radians(1), shift_mm;
  return result;
}

Move move(const Vector6d& step) {
  const RigidTransform seen = guide::motion_of(step, kCentre);
  return {guide::told_for(seen, kTrue), seen, kCentre};
}

const std::vector<Move> kMoves{move(motion({8, 0, 0}, {5, 2, 0})), move(motion({0, 7, 2}, {0, -4, 6})),
                               move(motion({1, -2, 6}, {8, 0, -3}))};

double turn_deg(const RigidTransform& found) { return turn_between_deg(found, kTrue); }
double shift_mm(const RigidTransform& found) { return (found * kCentre - kTrue * kCentre).norm(); }

RigidTransform far_guess() { return {"robot", "reference", Matrix3d::Identity(), {100, -20, 260}}; }

TEST(HandEye, TwoMovesDetermineItFromAnyGuess) {
  const auto found =
      robot::estimate_hand_eye({kMoves[0], kMoves[1]}, far_guess(), {0.02, 0.02, 0, 120, 200}).robot_from_reference;
  EXPECT_LT(turn_deg(found), 0.1);
  EXPECT_LT(shift_mm(found), 2);
}

TEST(HandEye, WithoutAMoveItIsTheGuessWithItsDeviations) {
  const robot::HandEye found = robot::estimate_hand_eye({}, far_guess(), {0.1, 0.1, 0, 60, 50});
  EXPECT_TRUE(found.robot_from_reference.rotation.isIdentity(1e-9));
  EXPECT_NEAR(degrees(std::sqrt(found.covariance(0, 0))), 60, 1);
  EXPECT_NEAR(std::sqrt(found.covariance(4, 4)), 50, 1);
}

TEST(HandEye, OneMoveLeavesTheTurnAboutItsAxisToTheGuess) {
  const robot::HandEye found =
      robot::estimate_hand_eye({move(motion({8, 0, 0}, {0, 0, 0}))}, far_guess(), {0.1, 0.1, 0, 60, 50});
  const Vector3d axis = found.robot_from_reference.rotation * Vector3d::UnitX();
  EXPECT_LT(degrees(std::acos(std::min(1.0, axis.dot(kTrue.rotation * Vector3d::UnitX())))), 2);
  EXPECT_GT(degrees(std::sqrt(found.covariance(0, 0))), 40);
  EXPECT_LT(degrees(std::sqrt(found.covariance(1, 1))), 3);
}

TEST(HandEye, AMoveThatFailedHardlyCounts) {
  std::vector<Move> moves = kMoves;
  moves.push_back(move(motion({3, 3, 3}, {1, 1, 1})));
  moves.push_back(move(motion({-6, 3, 2}, {1, 5, 1})));
  moves[1].seen = {"reference", "reference"};  // the robot said it moved, but the fragment did not
  const auto found = robot::estimate_hand_eye(moves, far_guess(), {}).robot_from_reference;
  EXPECT_LT(turn_deg(found), 1.5);
}

TEST(HandEye, AxXbInClosedForm) {
  const RigidTransform found = robot::solve_ax_xb(kMoves).robot_from_reference;
  EXPECT_LT(turn_deg(found), 1e-6);
  EXPECT_LT(shift_mm(found), 1e-6);
  EXPECT_EQ(found.target, "robot");
  EXPECT_EQ(found.source, "reference");
}

TEST(HandEye, AxXbSaysWhatIsMissing) {
  EXPECT_EQ(MESSAGE_OF(robot::solve_ax_xb({kMoves[0]})), "the hand-eye transform needs 2 motions or more; there are 1");
  EXPECT_EQ(MESSAGE_OF(robot::solve_ax_xb({kMoves[0], move(motion({5, 0, 0}, {0, 3, 1}))})),
            "the motions of the hand-eye transform do not tell how the robot is turned: about one axis nothing is "
            "known; turn it further, about axes that are at least 30 degrees apart");
}

Vector3d drawn(Random& random, double deviation) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return deviation * Vector3d(x, y, z);
}

std::vector<robot::Station> stations(const RigidTransform& hand_from_target, const RigidTransform& base_from_world,
                                     double noise, int count = 6) {
  Random random(3);
  std::vector<robot::Station> all;
  for (int i = 0; i < count; ++i) {
    robot::Station station;
    station.base_from_hand.rotation = rotation_from_vector(drawn(random, 0.4));
    station.base_from_hand.translation_mm = drawn(random, 30);
    station.world_from_target = inverse(base_from_world) * station.base_from_hand * hand_from_target;
    station.world_from_target.rotation =
        station.world_from_target.rotation * rotation_from_vector(drawn(random, noise * 0.01));
    station.world_from_target.translation_mm += drawn(random, noise);
    all.push_back(station);
  }
  return all;
}

const RigidTransform kHand{"hand", "target", rotation_from_vector({0.3, 2.5, -1}), {10, 60, -20}};
const RigidTransform kBase{"base", "world", rotation_from_vector({-2, 0.2, 1}), {400, -100, 80}};

TEST(HandEye, AxZbFindsBothTransforms) {
  const robot::RobotWorld found = robot::solve_ax_zb(stations(kHand, kBase, 0));
  EXPECT_LT(turn_between_deg(found.hand_from_target, kHand), 1e-5);
  EXPECT_LT(shift_between_mm(found.hand_from_target, kHand), 1e-5);
  EXPECT_LT(turn_between_deg(found.base_from_world, kBase), 1e-5);
  EXPECT_LT(shift_between_mm(found.base_from_world, kBase), 1e-5);
}

TEST(HandEye, AxZbAveragesNoise) {
  const robot::RobotWorld found = robot::solve_ax_zb(stations(kHand, kBase, 0.1, 12));
  EXPECT_LT(turn_between_deg(found.base_from_world, kBase), 0.2);
  EXPECT_LT(shift_between_mm(found.base_from_world, kBase), 1);
}

TEST(HandEye, AxZbSaysWhatIsMissing) {
  EXPECT_EQ(MESSAGE_OF(robot::solve_ax_zb(stations(kHand, kBase, 0, 2))),
            "the robot's place needs 3 stations or more; there are 2");
  std::vector<robot::Station> about_one_axis(3);
  for (int i = 0; i < 3; ++i)
    about_one_axis[std::size_t(i)].base_from_hand.rotation = rotation_from_vector({0, 0, 0.2 * i});
  EXPECT_EQ(MESSAGE_OF(robot::solve_ax_zb(about_one_axis)),
            "the stations of the robot do not tell how the robot is turned: about one axis nothing is known; turn it "
            "further, about axes that are at least 30 degrees apart");
}

// How well a robot's place is known from noisy stations: turns about one axis, and the predicted deviations against
// those of drawn stations whose right answer is known.

/// The move that is wanted, and where it leads the fragment's middle.
const RigidTransform kMotion{"world", "world", rotation_from_vector({0.2, -0.1, 0.3}), {12, -20, 25}};
const Vector3d kPlace(20, -30, 100);

/// The hand turned like this; the target near the world's origin is seen with noise.
Station station(const Vector3d& turn_deg, const Vector3d& shift_mm, double noise_deg, double noise_mm, Random& random) {
  // The hand's middle is where the target lies in the middle of the world.
  RigidTransform hand{"base", "hand", rotation_from_vector(radians(1) * turn_deg), Vector3d::Zero()};
  hand.translation_mm = kBase.translation_mm + shift_mm - hand.rotation * kHand.translation_mm;
  Station made;
  made.base_from_hand = hand;
  made.world_from_target = inverse(kBase) * hand * kHand;
  made.world_from_target.rotation =
      rotation_from_vector(drawn(random, radians(noise_deg))) * made.world_from_target.rotation;
  made.world_from_target.translation_mm += drawn(random, noise_mm);
  return made;
}

std::vector<Move> moves_between(const std::vector<Station>& stations) {
  std::vector<Move> moves;
  for (std::size_t i = 0; i < stations.size(); ++i)
    for (std::size_t j = i + 1; j < stations.size(); ++j)
      moves.push_back({stations[j].base_from_hand * inverse(stations[i].base_from_hand),
                       stations[j].world_from_target * inverse(stations[i].world_from_target), Vector3d::Zero()});
  return moves;
}

/// Errors of places found, against their predicted covariances.
struct Errors {
  double distance2 = 0;  ///< mean squared Mahalanobis distance of the place
  /// Mean squared errors of the fragment after a move with this place, and their prediction.
  double turn2 = 0, shift2 = 0, predicted_turn2 = 0, predicted_shift2 = 0;

  void add(const RigidTransform& base_from_world, const Matrix6d& covariance, double weight) {
    const RigidTransform off = inverse(kBase) * base_from_world;
    const Vector6d place = motion_between({"world", "world"}, off, FragmentFrame());
    distance2 += weight * place.dot(inverse_of_symmetric(covariance) * place);
    const RigidTransform left = off * kMotion * inverse(off) * inverse(kMotion);
    const Matrix6d predicted = robot::left_by(kMotion, covariance, kPlace);
    turn2 += weight * vector_from_rotation(left.rotation).squaredNorm();
    shift2 += weight * (left * kPlace - kPlace).squaredNorm();
    predicted_turn2 += weight * predicted.topLeftCorner<3, 3>().trace();
    predicted_shift2 += weight * predicted.bottomRightCorner<3, 3>().trace();
  }
};

TEST(HandEyeNoise, ThePredictedDeviationsAreThoseOfDrawnStations) {
  constexpr int kDraws = 200;
  constexpr std::size_t kStations = 8;
  Errors of_zb, of_xb;
  Random random(5);
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<Station> stations;
    for (std::size_t i = 0; i < kStations; ++i)
      stations.push_back(station(drawn(random, 8), drawn(random, 6), 0.1, 0.2, random));
    const robot::RobotWorld zb = robot::solve_ax_zb(stations);
    of_zb.add(zb.base_from_world, zb.covariance, 1.0 / kDraws);
    // The motions between n stations share the noise of the stations, so their covariance counts (n + 1) / 2 times
    // (open_loop.cpp).
    const robot::HandEye xb = robot::solve_ax_xb(moves_between(stations));
    of_xb.add(xb.robot_from_reference, 0.5 * (kStations + 1) * xb.covariance, 1.0 / kDraws);
  }
  for (const Errors& errors : {of_zb, of_xb}) {
    // Chi-squared with 6 degrees of freedom has the mean 6. The noise is estimated from 18 numbers, which makes it
    // 6 * 18 / 16 = 6.75; the mean of 200 draws has a deviation of 0.3.
    EXPECT_NEAR(errors.distance2, 6.75, 1.5);
    EXPECT_NEAR(errors.turn2 / errors.predicted_turn2, 1, 0.25);
    EXPECT_NEAR(errors.shift2 / errors.predicted_shift2, 1, 0.25);
  }
}

/// Turns about x only, and home twice; the target is seen with noise. Between the two visits at home there is a small
/// turn about any axis, which is no second axis.
std::vector<Station> about_one_axis(double noise_deg, double noise_mm, std::uint64_t seed) {
  Random random(seed);
  std::vector<Station> stations;
  for (const double turn_deg : {0.0, 12.0, 0.0, -12.0, 6.0, -6.0}) {
    // The hand's encoders err, too.
    const Vector3d hand_deg = Vector3d(turn_deg, 0, 0) + drawn(random, 0.2 * noise_deg);
    stations.push_back(station(hand_deg, {0, 0, 0}, noise_deg, noise_mm, random));
  }
  return stations;
}

/// The error that a move would leave, in mm; infinite if no place is found.
double left_mm(const std::vector<Station>& stations, bool by_motions) {
  Matrix6d covariance;
  const std::string refused =
      MESSAGE_OF(covariance = by_motions ? Matrix6d(0.5 * double(stations.size() + 1) *
                                                    robot::solve_ax_xb(moves_between(stations)).covariance)
                                         : robot::solve_ax_zb(stations).covariance);
  if (!refused.empty()) return std::numeric_limits<double>::infinity();
  const Matrix6d left = robot::left_by(kMotion, covariance, kPlace);
  return std::sqrt(eigen_of_symmetric<3>(left.bottomRightCorner<3, 3>()).values[2]);
}

TEST(HandEyeNoise, NoiseIsNoSecondAxis) {
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed)
    for (const bool by_motions : {false, true}) {
      const double left = left_mm(about_one_axis(0.1, 0.1, seed), by_motions);
      EXPECT_GT(left, 2) << seed << ": guide.open_loop would make this move";
      refused += std::isinf(left);
    }
  EXPECT_GE(refused, 90) << "of 100";
  const std::string
      zb = MESSAGE_OF(robot::solve_ax_zb(about_one_axis(0.1, 0.1, 1))),
      xb = MESSAGE_OF(robot::solve_ax_xb(moves_between(about_one_axis(0.1, 0.1, 1)))),
      remedy = " degrees only (one standard deviation); turn it further, about axes that are at least 30 degrees apart";
  EXPECT_FRAME(zb, "the stations of the robot do not tell how the robot is turned: it is known to ", remedy);
  EXPECT_FRAME(xb, "the motions of the hand-eye transform do not tell how the robot is turned: it is known to ",
               remedy);
}

TEST(HandEyeNoise, TurnsCountByTheirSize) {
  // The same axes, but turns of 0.2 degrees at a noise of 0.1: nothing is known. Turns of 10 degrees: all is.
  const auto stations = [](double turn_deg) {
    Random random(3);
    std::vector<Station> made;
    for (const Vector3d& axis : {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)})
      made.push_back(station(turn_deg * axis, {0, 0, 0}, 0.1, 0.1, random));
    return made;
  };
  EXPECT_NE(MESSAGE_OF(robot::solve_ax_zb(stations(0.2))), "");
  EXPECT_NE(MESSAGE_OF(robot::solve_ax_xb(moves_between(stations(0.2)))), "");
  EXPECT_EQ(MESSAGE_OF(robot::solve_ax_zb(stations(10))), "");
  EXPECT_EQ(MESSAGE_OF(robot::solve_ax_xb(moves_between(stations(10)))), "");
}

TEST(HandEyeNoise, ManyMovesAboutOneAxisLeaveTheTurnAboutItToTheGuess) {
  // The same for the loop's estimate: the told motions turn only about x, and what is seen about other axes is noise.
  const RigidTransform right{"robot", "reference", rotation_from_vector({1.1, -2, 0.7}), {120, -40, 300}};
  Random random(2);
  std::vector<Move> moves;
  for (int i = 0; i < 12; ++i) {
    Move move;
    move.told.rotation = rotation_from_vector({radians(i % 2 ? 8 : -8), 0, 0});
    move.seen = inverse(right) * move.told * right;
    move.seen.rotation = rotation_from_vector(drawn(random, radians(0.15))) * move.seen.rotation;
    move.seen.translation_mm += drawn(random, 0.15);
    move.centre_mm = inverse(right) * Vector3d(20, 0, 0);  // on the axis, so that its shifts tell nothing either
    moves.push_back(move);
  }
  const robot::HandEye found = robot::estimate_hand_eye(moves, right, {});
  const double worst = eigen_of_symmetric<3>(found.covariance.topLeftCorner<3, 3>()).values[2];
  EXPECT_GT(degrees(std::sqrt(worst)), 60);
}

}  // namespace marrow::test::hand_eye_test
