// SPDX-License-Identifier: Apache-2.0
// The kinematics of a hexapod against lengths computed by hand, and against each other.
#include "marrow/toolbox/robotics/hexapod.hpp"
#include "marrow/domain/random.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::hexapod_test {

using robot::Hexapod;
using test::message_of;

/// Legs in pairs from one joint at 0, 120 and 240 degrees to joints at 60, 180 and 300 degrees.
Hexapod simple() { return robot::make_hexapod({300, 100, 0, 0, 400}); }

RigidTransform pose(const Vector3d& rotation_deg, const Vector3d& at_mm) {
  return {"base", "platform", rotation_from_vector(rotation_deg * kPi / 180), at_mm};
}

TEST(Hexapod, LegsAtHomeAreAsLongAsComputedByHand) {
  // From (300, 0, 0) to (100 cos 60, +-100 sin 60, 400): the squares are 250^2 + 7500 + 400^2.
  const Hexapod hexapod = simple();
  const Vector6d lengths = robot::leg_lengths_mm(hexapod, hexapod.base_from_home);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(lengths[i], std::sqrt(62500.0 + 7500 + 160000), 1e-9) << i;
}

TEST(Hexapod, ALiftAndATurnAreAsComputedByHand) {
  const Hexapod hexapod = simple();
  // Lifted by 100 mm.
  EXPECT_NEAR(robot::leg_lengths_mm(hexapod, pose({0, 0, 0}, {0, 0, 500}))[0], std::sqrt(62500.0 + 7500 + 250000),
              1e-9);
  // Turned by 60 degrees about z: leg 1 ends at (100, 0), leg 2 at (100 cos 120, 100 sin 120).
  const Vector6d turned = robot::leg_lengths_mm(hexapod, pose({0, 0, 60}, {0, 0, 400}));
  EXPECT_NEAR(turned[0], std::sqrt(200.0 * 200 + 400 * 400), 1e-9);
  EXPECT_NEAR(turned[1], std::sqrt(350.0 * 350 + 7500 + 400 * 400), 1e-9);
}

TEST(Hexapod, ALegTurnsInItsJoints) {
  // One leg straight up of 100 mm: a shift of 100 mm turns it by 45 degrees in both joints. A turn of the platform by
  // 10 degrees about that joint leaves the leg where it is, and turns it in the platform's joint only.
  Hexapod hexapod;
  for (std::size_t i = 0; i < 6; ++i) hexapod.base_mm[i] = hexapod.platform_mm[i] = Vector3d::Zero();
  hexapod.base_from_home.translation_mm.z() = 100;
  EXPECT_NEAR(degrees(robot::joint_angles_rad(hexapod, pose({0, 0, 0}, {100, 0, 100}))[3]), 45, 1e-9);
  EXPECT_NEAR(degrees(robot::joint_angles_rad(hexapod, pose({10, 0, 0}, {0, 0, 100}))[3]), 10, 1e-9);
}

TEST(Hexapod, FourStepsLeadFromHomeToAnyPose) {
  const Hexapod hexapod = robot::make_hexapod({});
  Random random(7);
  const auto within = [&](double most) { return most * (2 * random.uniform() - 1); };
  int most_steps = 0;
  for (int i = 0; i < 200; ++i) {
    const RigidTransform wanted =
        pose({within(15), within(15), within(15)}, {within(15), within(15), 220 + within(15)});
    const auto found = robot::pose_of_legs(hexapod, robot::leg_lengths_mm(hexapod, wanted), hexapod.base_from_home);
    EXPECT_LT(geodesic_angle_rad(found.base_from_platform.rotation, wanted.rotation), 1e-9);
    EXPECT_LT(shift_between_mm(found.base_from_platform, wanted), 1e-7);
    most_steps = std::max(most_steps, found.steps);
  }
  EXPECT_GE(most_steps, 4);
  EXPECT_LE(most_steps, 5);
  EXPECT_EQ(robot::pose_of_legs(hexapod, robot::leg_lengths_mm(hexapod, hexapod.base_from_home), hexapod.base_from_home)
                .steps,
            0);
}

TEST(Hexapod, AMotionBeyondTheLimitsIsRefused) {
  const Hexapod hexapod = simple();
  EXPECT_EQ(message_of([&] {
              robot::check_workspace(hexapod, {60, 40}, pose({0, 0, 0}, {0, 0, 500}), "motion 'up'");
            }),
            "motion 'up' is outside the hexapod's workspace: leg 1 would be 565.7 mm long, its limits are 419.6 mm and "
            "539.6 mm; give a smaller motion");
  EXPECT_EQ(message_of([&] {
              robot::check_workspace(hexapod, {60, 5}, pose({0, 0, 20}, {0, 0, 400}), "motion 'turn'");
            }),
            "motion 'turn' is outside the hexapod's workspace: leg 1 would turn by 12.5 degrees in its joint, its "
            "limit is 5.0 degrees; give a smaller motion");
  EXPECT_EQ(message_of([&] { robot::check_workspace(hexapod, {60, 40}, hexapod.base_from_home, "home"); }), "");
}

TEST(Hexapod, LengthsWithoutAPoseAreRefused) {
  const Hexapod hexapod = simple();
  Vector6d lengths = robot::leg_lengths_mm(hexapod, hexapod.base_from_home);
  lengths[0] = 100000;
  EXPECT_NE(message_of([&] {
              robot::pose_of_legs(hexapod, lengths, hexapod.base_from_home);
            }).find("no pose of the platform near the start has these lengths of the legs"),
            std::string::npos);
  lengths[0] = NAN;
  EXPECT_EQ(message_of([&] { robot::pose_of_legs(hexapod, lengths, hexapod.base_from_home); }),
            "the lengths of the hexapod's legs are not all numbers");
}

TEST(Hexapod, LegsInOneLineWithTheirPlatformDoNotHoldIt) {
  // A platform as large as its base, with parallel legs, is free to swing.
  Hexapod hexapod = simple();
  hexapod.platform_mm = hexapod.base_mm;
  Vector6d lengths = robot::leg_lengths_mm(hexapod, hexapod.base_from_home);
  lengths[0] += 1;
  EXPECT_EQ(message_of([&] { robot::pose_of_legs(hexapod, lengths, hexapod.base_from_home); }),
            "the hexapod's legs do not hold the platform in this pose: the pose is singular, at most 100 is allowed; "
            "give another motion, or another shape of the hexapod");
}

TEST(Hexapod, SmallErrorsOfLegsBecomeSmallErrorsOfThePose) {
  // Legs with errors of 0.02 mm: the motion from home is off by 0.01 to 0.02 degrees and about 0.04 mm.
  const Hexapod hexapod = robot::make_hexapod({});
  Random random(3);
  double turn2 = 0, shift2 = 0;
  constexpr int kRuns = 400;
  for (int i = 0; i < kRuns; ++i) {
    Vector6d lengths = robot::leg_lengths_mm(hexapod, hexapod.base_from_home);
    for (int k = 0; k < 6; ++k) lengths[k] += 0.02 * random.normal();
    const auto found = robot::pose_of_legs(hexapod, lengths, hexapod.base_from_home).base_from_platform;
    turn2 += std::pow(degrees(vector_from_rotation(found.rotation).norm()), 2);
    shift2 += (found.translation_mm - hexapod.base_from_home.translation_mm).squaredNorm();
  }
  EXPECT_GT(std::sqrt(turn2 / kRuns), 0.01);
  EXPECT_LT(std::sqrt(turn2 / kRuns), 0.025);
  EXPECT_GT(std::sqrt(shift2 / kRuns), 0.02);
  EXPECT_LT(std::sqrt(shift2 / kRuns), 0.06);
}

}  // namespace marrow::test::hexapod_test
