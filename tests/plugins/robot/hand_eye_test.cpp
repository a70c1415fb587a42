// SPDX-License-Identifier: Apache-2.0
// Hand-eye calibration against motions that are made with a known transform.
#include "marrow/toolbox/robotics/hand_eye.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/guide/servo.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::hand_eye_test {

using robot::Move;
using test::message_of;

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
  EXPECT_EQ(message_of([] { robot::solve_ax_xb({kMoves[0]}); }),
            "the hand-eye transform needs 2 motions or more; there are 1");
  EXPECT_EQ(message_of([] {
              robot::solve_ax_xb({kMoves[0], move(motion({5, 0, 0}, {0, 3, 1}))});
            }),
            "the motions of the hand-eye transform do not tell how the robot is turned: about one axis nothing is "
            "known; turn it further, about axes that are at least 30 degrees apart");
}

std::vector<robot::Station> stations(const RigidTransform& hand_from_target, const RigidTransform& base_from_world,
                                     double noise, int count = 6) {
  Random random(3);
  const auto vector = [&](double sd) {
    const double x = random.normal(), y = random.normal(), z = random.normal();
    return Vector3d(sd * Vector3d(x, y, z));
  };
  std::vector<robot::Station> all;
  for (int i = 0; i < count; ++i) {
    robot::Station station;
    station.base_from_hand.rotation = rotation_from_vector(vector(0.4));
    station.base_from_hand.translation_mm = vector(30);
    station.world_from_target = inverse(base_from_world) * station.base_from_hand * hand_from_target;
    station.world_from_target.rotation =
        station.world_from_target.rotation * rotation_from_vector(vector(noise * 0.01));
    station.world_from_target.translation_mm += vector(noise);
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
  EXPECT_EQ(message_of([] { robot::solve_ax_zb(stations(kHand, kBase, 0, 2)); }),
            "the robot's place needs 3 stations or more; there are 2");
  std::vector<robot::Station> about_one_axis(3);
  for (int i = 0; i < 3; ++i)
    about_one_axis[std::size_t(i)].base_from_hand.rotation = rotation_from_vector({0, 0, 0.2 * i});
  EXPECT_EQ(message_of([&] { robot::solve_ax_zb(about_one_axis); }),
            "the stations of the robot do not tell how the robot is turned: about one axis nothing is known; turn it "
            "further, about axes that are at least 30 degrees apart");
}

}  // namespace marrow::test::hand_eye_test
