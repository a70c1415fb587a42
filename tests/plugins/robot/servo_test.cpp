// SPDX-License-Identifier: Apache-2.0
#include "marrow/guide/servo.hpp"
#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/robotics/hexapod.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::servo_test {

using robot::Hexapod, robot::Move;

// The laws of the loop, closed around a fragment whose pose is measured with noise, without images.

enum class Law { fixed, broyden, estimated };

/// Pairs of images until the fragment is within 1 degree and 1 mm; 41 if 40 are not enough.
int pairs_of(Law law, double phi_deg, double damping, std::uint64_t seed) {
  Random random(seed);
  const Vector3d centre(0, 0, 100);
  const RigidTransform guess{"robot", "reference", Matrix3d::Identity(), Vector3d::Zero()};
  Vector6d off;
  off << radians(phi_deg) * phantom::random_direction(random), 50 * phantom::random_direction(random);
  const RigidTransform right = moved(guess, {centre, Matrix3d::Identity()}, off);
  RigidTransform pose{"reference", "fragment"};
  Vector6d start;
  start << radians(5 + 15 * random.uniform()) * phantom::random_direction(random),
      17 * phantom::random_direction(random);
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

// How well a hexapod's legs hold its platform: the condition of their Jacobian against numpy, and who looks at it.

RigidTransform pose(const Vector3d& rotation_deg, const Vector3d& at_mm) {
  return {"base", "platform", rotation_from_vector(rotation_deg * kPi / 180), at_mm};
}

/// With numpy: rows [(R b x u) / L, u] of each leg, with u its direction, b its joint on the platform and L the root
/// mean square of |b|; then the largest over the smallest of numpy.linalg.svd.
TEST(HexapodCondition, IsThatOfNumpy) {
  const Hexapod hexapod = robot::make_hexapod({});
  EXPECT_NEAR(robot::condition(hexapod, hexapod.base_from_home), 3.57105228310841, 1e-9);
  EXPECT_NEAR(robot::condition(hexapod, pose({10, -5, 20}, {12, -7, 231})), 4.07454667876162, 1e-9);
  EXPECT_NEAR(robot::condition(hexapod, pose({0, 0, 80}, {0, 0, 220})), 18.8123644563, 1e-8);
  EXPECT_NEAR(robot::condition(hexapod, pose({0, 0, 88}, {0, 0, 220})), 94.9780666538, 1e-6);
  const Hexapod near = robot::make_hexapod({150, 90, 54, 60, 220});
  EXPECT_NEAR(robot::condition(near, near.base_from_home), 41.0714576825, 1e-7);
}

TEST(HexapodCondition, IsTheSameInOtherUnitsOfLength) {
  const Hexapod small = robot::make_hexapod({15, 9, 24, 24, 22}), large = robot::make_hexapod({});
  EXPECT_NEAR(robot::condition(small, small.base_from_home), robot::condition(large, large.base_from_home), 1e-9);
}

TEST(HexapodCondition, PosesThatTheLegsDoNotHoldAreOutsideTheWorkspace) {
  const Hexapod hexapod = robot::make_hexapod({});
  const auto refused = [&](double turn_deg) {
    return MESSAGE_OF(
        robot::check_workspace(hexapod, {1000, 180}, pose({0, 0, turn_deg}, {0, 0, 220}), "motion 'turn'"));
  };
  EXPECT_EQ(refused(88), "");
  // A turn by a quarter is singular for any hexapod of this kind (Fichter 1986). Beyond it the legs hold the platform
  // again, but the platform cannot get there.
  EXPECT_FRAME(refused(90), "motion 'turn': the hexapod's legs do not hold the platform in this pose: ",
               ", at most 100 is allowed; give another motion, or another shape of the hexapod");
  EXPECT_EQ(refused(100),
            "motion 'turn': the hexapod cannot come from home to this pose: on the way its legs pass a singular pose, "
            "where they do not hold the platform; give a smaller motion");
}

TEST(HexapodCondition, NoPoseIsFoundWhereTheLegsDoNotHoldThePlatform) {
  // Base and platform with joints at the same angles: the legs hold the platform nowhere.
  const Hexapod free = robot::make_hexapod({150, 90, 60, 60, 220});
  Vector6d lengths = robot::leg_lengths_mm(free, free.base_from_home);
  lengths[0] += 0.02;
  EXPECT_EQ(MESSAGE_OF(robot::pose_of_legs(free, lengths, free.base_from_home)),
            "the hexapod's legs do not hold the platform in this pose: the pose is singular, at most 100 is allowed; "
            "give another motion, or another shape of the hexapod");
  // The joints' errors make it regular, but not better.
  EXPECT_BEGINS(MESSAGE_OF(robot::pose_of_legs(robot::as_built(free, 0.05, 1), lengths, free.base_from_home)),
                "the hexapod's legs do not hold the platform in this pose: the condition of its legs is ");
}

/// A motion of the platform from home.
Pose shifted(double up_mm) {
  Pose pose;
  pose.world_from_model = {"home", "platform", Matrix3d::Identity(), {0, 0, up_mm}};
  return pose;
}

/// A shape by the angles between its joints.
Options shape(double base_gap_deg) { return {{"base_gap_deg", base_gap_deg}, {"platform_gap_deg", 60.0}}; }

const phantom::Phantom& broken() {
  static const phantom::Phantom made = simulated::fracture(simulated::femur({}), {});
  return made;
}

TEST(HexapodCondition, ASingularHexapodIsRefusedByAllNodes) {
  const Inputs phantom{{"phantom", item(broken())}};
  EXPECT_EQ(refusal("robot.hexapod", phantom, shape(60)),
            "robot.hexapod: home: the hexapod's legs do not hold the platform in this pose: the pose is singular, at "
            "most 100 is allowed; give another motion, or another shape of the hexapod");
  List<Pose> commands;
  commands.add("up", shifted(2));
  EXPECT_EQ(refusal("simulate.hexapod",
                    {{"phantom", item(broken())}, {"commands", shipped::list(commands, "position")}}, shape(60)),
            "simulate.hexapod: home: the hexapod's legs do not hold the platform in this pose: the pose is singular, "
            "at most 100 is allowed; give another motion, or another shape of the hexapod");
}

TEST(HexapodCondition, AHexapodNearASingularPoseIsWarnedOf) {
  Heard heard;
  const List<Pose> commands = named("stays", shifted(0));
  const auto made =
      call("simulate.hexapod", {{"phantom", item(broken())}, {"commands", shipped::list(commands, "position")}},
           shape(54), heard.context);
  EXPECT_EQ(heard.warnings,
            Strings{"a motion comes near a singular pose of the hexapod: the condition of its legs is 41, and "
                    "above 20 an error of a leg moves the platform several times as far as usual"});
  EXPECT_NEAR(figure(item(made.at("legs").as_list<Metrics>()[0]), "condition"), 41.0714576825, 1e-6);
  heard.warnings.clear();
  call("robot.hexapod", {{"phantom", item(broken())}},
       {{"base_gap_deg", 54.0},
        {"platform_gap_deg", 60.0},
        {"base_radius_mm", 150.0},
        {"platform_radius_mm", 90.0},
        {"height_mm", 220.0}},
       heard.context);
  ASSERT_EQ(heard.warnings.size(), 1u);
  EXPECT_BEGINS(heard.warnings[0], "home comes near a singular pose of the hexapod: the condition of its legs is ");
}

}  // namespace marrow::test::servo_test
