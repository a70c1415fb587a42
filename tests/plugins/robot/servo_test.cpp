// SPDX-License-Identifier: Apache-2.0
// The laws of the loop, closed around a fragment whose pose is measured with noise, without images.
#include "marrow/guide/servo.hpp"
#include "marrow/domain/random.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::servo_test {

using robot::Move;

enum class Law { fixed, broyden, estimated };

Vector3d direction(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return Vector3d(x, y, z).normalized();
}

/// Pairs of images until the fragment is within 1 degree and 1 mm; 41 if 40 are not enough.
int pairs_of(Law law, double phi_deg, double damping, std::uint64_t seed) {
  Random random(seed);
  const Vector3d centre(0, 0, 100);
  const RigidTransform guess{"robot", "reference", Matrix3d::Identity(), Vector3d::Zero()};
  Vector6d off;
  off << radians(phi_deg) * direction(random), 50 * direction(random);
  const RigidTransform right = moved(guess, {centre, Matrix3d::Identity()}, off);
  RigidTransform pose{"reference", "fragment"};
  Vector6d start;
  start << radians(5 + 15 * random.uniform()) * direction(random), 17 * direction(random);
  pose = guide::motion_of(start, centre) * pose;
  const guide::StepLimits limits{damping, 8, 12};
  RigidTransform x = guess;
  Matrix6d jacobian = Matrix6d::Identity();
  std::vector<Move> moves;
  RigidTransform seen_before, told;
  Vector6d asked;
  for (int pair = 1; pair <= 40; ++pair) {
    Vector6d noise;
    for (int k = 0; k < 6; ++k) noise[k] = random.normal() * (k < 3 ? radians(0.1) : 0.06);
    const RigidTransform seen = guide::motion_of(noise, pose * centre) * pose;
    const Vector3d middle = seen * centre;
    Vector6d error;
    error << vector_from_rotation(seen.rotation), middle - centre;
    if (pair > 1) {
      const RigidTransform happened = seen * inverse(seen_before);
      const Vector3d from = seen_before * centre;
      moves.push_back({told, happened, from});
      if (law == Law::estimated) x = robot::estimate_hand_eye(moves, guess, {}).robot_from_reference;
      if (law == Law::broyden)
        jacobian = guide::broyden(jacobian, guide::in_mm(asked), guide::in_mm(guide::step_of(happened, from)));
    }
    // The true error: pairs count until it is small.
    if (degrees(vector_from_rotation(pose.rotation).norm()) < 1 && (pose * centre - centre).norm() < 1) return pair;
    asked = guide::limited_step(error, limits);
    if (law == Law::broyden) {
      asked = -guide::from_mm(guide::ask_for(jacobian, -guide::in_mm(asked)));
      asked = guide::limited_step(-asked, {1, 8, 12});
    }
    told = guide::told_for(guide::motion_of(asked, middle), x);
    pose = (inverse(right) * told * right) * pose;
    seen_before = seen;
  }
  return 41;
}

struct Row {
  int median, worst, failed;
};

Row run(Law law, double phi_deg, double damping, int count = 60) {
  std::vector<int> pairs;
  for (int i = 0; i < count; ++i) pairs.push_back(pairs_of(law, phi_deg, damping, std::uint64_t(i + 1)));
  std::sort(pairs.begin(), pairs.end());
  return {pairs[pairs.size() / 2], pairs.back(), int(std::count(pairs.begin(), pairs.end(), 41))};
}

// Fixed: stable if and only if lambda < 2 cos phi. So at 45 degrees it is slow, and at 90 degrees it cannot end.
TEST(Servo, AFixedHandEyeTransformMustBeRoughlyRight) {
  EXPECT_LE(run(Law::fixed, 10, 0.7).median, 5);
  const Row at_45 = run(Law::fixed, 45, 0.7);
  EXPECT_GE(at_45.median, 10);
  EXPECT_LE(at_45.median, 15);
  EXPECT_EQ(at_45.failed, 0);
  EXPECT_EQ(run(Law::fixed, 90, 0.7).failed, 60);
  EXPECT_GT(run(Law::fixed, 60, 1.0).failed, 50);
}

TEST(Servo, BroydensUpdateNeedsMorePairsTheFartherTheGuessIsOff) {
  EXPECT_LE(run(Law::broyden, 10, 0.7).median, 5);
  EXPECT_LE(run(Law::broyden, 45, 0.7).median, 7);
  const Row at_90 = run(Law::broyden, 90, 0.7), at_150 = run(Law::broyden, 150, 0.7);
  EXPECT_GE(at_90.median, 9);
  EXPECT_LE(at_90.median, 13);
  EXPECT_GT(at_150.median, at_90.median);
}

TEST(Servo, AnEstimatedHandEyeTransformMayBeOffByAnyRotation) {
  EXPECT_LE(run(Law::estimated, 10, 1).median, 4);
  EXPECT_LE(run(Law::estimated, 45, 1).median, 4);
  for (const double phi_deg : {90, 150, 179}) {
    const Row row = run(Law::estimated, phi_deg, 1);
    EXPECT_LE(row.median, 5) << phi_deg;
    EXPECT_LE(row.worst, 7) << phi_deg;
    EXPECT_EQ(row.failed, 0) << phi_deg;
  }
}

TEST(Servo, AStepIsShortenedAsAWholeUntilItPassesNoLimit) {
  Vector6d error;
  error << 0, 0, radians(16), 6, 0, 0;
  const Vector6d step = guide::limited_step(error, {1, 8, 12});
  EXPECT_NEAR(degrees(step[2]), -8, 1e-9);
  EXPECT_NEAR(step[3], -3, 1e-9);
  error << 0, 0, radians(2), 0, 24, 0;
  EXPECT_NEAR(guide::limited_step(error, {1, 8, 12})[4], -12, 1e-9);
  EXPECT_NEAR(degrees(guide::limited_step(error, {0.5, 8, 100})[2]), -1, 1e-9);
}

TEST(Servo, AMotionAboutThePointAndBack) {
  Vector6d step;
  step << 0.1, -0.2, 0.3, 4, 5, 6;
  const Vector3d centre(10, 20, 30);
  const RigidTransform motion = guide::motion_of(step, centre);
  EXPECT_LT((motion * centre - centre - Vector3d(4, 5, 6)).norm(), 1e-9);
  EXPECT_LT((guide::step_of(motion, centre) - step).norm(), 1e-9);
}

// J dq is then what was seen, and other directions stay as they were.
TEST(Servo, BroydensJacobianExplainsTheLastMotion) {
  Vector6d asked, seen, other;
  asked << 1, 2, 0, 0, 3, 0;
  seen << 0, 1, 1, 4, 0, 0;
  other << 0, 0, 1, 0, 0, 0;
  const Matrix6d jacobian = guide::broyden(Matrix6d::Identity(), asked, seen);
  EXPECT_LT((jacobian * asked - seen).norm(), 1e-12);
  EXPECT_LT((jacobian * other - other).norm(), 1e-12);
  EXPECT_EQ(guide::broyden(jacobian, 0.01 * asked, seen), jacobian);
  EXPECT_LT((jacobian * guide::ask_for(jacobian, seen, 0) - seen).norm(), 1e-9);
  EXPECT_LT(guide::ask_for(Matrix6d::Zero(), seen).norm(), 1e-12);
}

}  // namespace marrow::test::servo_test
