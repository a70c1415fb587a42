// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/random.hpp"
#include "marrow/guide/servo.hpp"
#include "marrow/robot/contact.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::robot_test {

using phantom::Phantom;
using robot::Hexapod, robot::RobotReport, robot::RobotState;

// A simulated robot that holds the distal fragment of a fractured femur.

const phantom::Bone& femur() {
  static const phantom::Bone made = simulated::femur({});
  return made;
}

Phantom broken(Numbers rotation_deg, Numbers translation_mm) {
  return simulated::fracture(femur(), {{"rotation_deg", rotation_deg}, {"translation_mm", translation_mm}});
}

const Options kExact{{"leg_sd_mm", 0.0}, {"joint_sd_mm", 0.0}, {"give_mm_per_n", 0.0}, {"give_deg_per_nm", 0.0}};

/// Exact, and its axes are those of the world.
const Options kStraight = with(kExact, {{"stand_off_deg", Numbers{0, 0, 0}}, {"stand_off_mm", Numbers{0, 0, 0}}});

Outputs gripped(const Phantom& phantom, Options options = kExact) {
  return call("robot.hexapod", {{"phantom", item(phantom)}}, options);
}

Outputs move(const Phantom& phantom, const Outputs& before, const RigidTransform& motion) {
  Pose told = pose_of(motion);
  return call("robot.move", {{"phantom", item(phantom)},
                             {"state", before.at("state")},
                             {"motion", item(told)},
                             {"report", before.at("report")}});
}

RigidTransform shift(double x, double y, double z) { return {"robot", "robot", Matrix3d::Identity(), {x, y, z}}; }

TEST(Contact, WholeBoneIsApartAndPressedBoneIsNot) {
  const robot::Contact contact(broken({0, 0, 0}, {0, 0, 0}), "test");
  RigidTransform place{"bone", "bone"};
  place.translation_mm.z() = -2;
  EXPECT_EQ(contact.overlap_mm(place), 0);
  place.translation_mm.z() = 4;
  EXPECT_GT(contact.overlap_mm(place), 1.5);
  EXPECT_LT(contact.overlap_mm(place), 5.5);  // 4 mm, and the relief of the fracture
  place.translation_mm = {60, 0, 30};
  EXPECT_EQ(contact.overlap_mm(place), 0);
}

TEST(Contact, NeedsAFracture) {
  EXPECT_EQ(MESSAGE_OF(robot::Contact(Phantom{}, "test")),
            "test: the phantom is of a whole bone; a broken one is needed");
}

TEST(SoftTissue, PullsAsMuchAsItShould) {
  Vector6d displacement;
  displacement << 0, 0, radians(10), 0, 0, -15;
  robot::Load load = robot::load_of({}, displacement, 0);
  EXPECT_NEAR(load.force_n, 100 * std::exp(1.0), 1e-9);
  EXPECT_NEAR(load.torque_nm, 1.5, 1e-9);
  displacement << 0, 0, 0, 30, 40, 0;
  load = robot::load_of({}, displacement, 1);
  EXPECT_NEAR(load.force_n, std::hypot(100 + 300, 4 * 50), 1e-9);
}

TEST(Robot, DoesWhatItIsToldInItsOwnAxes) {
  const Phantom phantom = broken({0, 0, 0}, {5, 0, -8});
  const Outputs before = gripped(phantom, with(kStraight, {{"stand_off_deg", Numbers{0, 0, 90}}})),
                after = move(phantom, before, shift(3, 0, 0));
  const RigidTransform from = before.at("state").as<RobotState>().world_from_ct,
                       to = after.at("state").as<RobotState>().world_from_ct;
  // Its x axis is the world's y axis, turned against it.
  EXPECT_LT((to.translation_mm - from.translation_mm - Vector3d(0, -3, 0)).norm(), 1e-6);
  EXPECT_LT((after.at("report").as<RobotReport>().done.translation_mm - Vector3d(3, 0, 0)).norm(), 1e-9);
  const Phantom now =
      output<Phantom>("robot.scene", "phantom", {{"phantom", item(phantom)}, {"state", after.at("state")}});
  EXPECT_EQ(phantom::fragment_named(now, "distal", "test").world_from_ct.translation_mm, to.translation_mm);
}

TEST(Robot, GoesOnFromWhereItIsWhateverThePhantomShows) {
  const Phantom phantom = broken({0, 0, 0}, {5, 0, -8});
  const Outputs once = move(phantom, gripped(phantom), shift(3, -2, -4));
  const RigidTransform there = once.at("state").as<RobotState>().world_from_ct;
  // No motion, with the phantom from before the first one.
  const Outputs again = move(phantom, once, shift(0, 0, 0));
  EXPECT_EQ(again.at("state").as<RobotState>().world_from_ct.translation_mm, there.translation_mm);
  EXPECT_EQ(again.at("report").as<RobotReport>().load.force_n, once.at("report").as<RobotReport>().load.force_n);
}

TEST(Robot, YieldsAndErrs) {
  const Phantom phantom = broken({0, 0, 0}, {5, 0, -4});
  const Outputs exact = gripped(phantom), real = gripped(phantom, {});
  const auto moved = [&](const Outputs& before) {
    return RigidTransform(move(phantom, before, shift(0, 0, -8)).at("state").as<RobotState>().world_from_ct);
  };
  const double apart = (moved(exact).translation_mm - moved(real).translation_mm).norm();
  EXPECT_GT(apart, 0.02);
  EXPECT_LT(apart, 1);
}

TEST(Robot, StopsBeforeTheForceThatIsTooLarge) {
  const Phantom phantom = broken({0, 0, 0}, {0, 0, -8});
  const Outputs after = move(phantom, gripped(phantom, kStraight), shift(0, 0, 30));
  const RobotReport report = after.at("report").as<RobotReport>();
  EXPECT_EQ(report.stopped, "the force would pass 400 N");
  EXPECT_TRUE(report.is_pressed);
  EXPECT_LE(report.largest_load.force_n, 400);
  EXPECT_LT(report.done.translation_mm.z(), 29);
  EXPECT_GT(report.done.translation_mm.z(), 2);
  EXPECT_EQ(figure(after.at("metrics"), "stopped"), 1);
}

TEST(Robot, StopsAtItsWorkspace) {
  const Phantom phantom = broken({0, 0, 0}, {0, 0, -8});
  const Outputs after = move(phantom, gripped(phantom, with(kExact, {{"stroke_mm", 3.0}})), shift(12, 0, 0));
  const RobotReport report = after.at("report").as<RobotReport>();
  EXPECT_BEGINS(report.stopped, "the motion is outside the hexapod's workspace: leg ");
  EXPECT_FALSE(report.is_pressed);
}

TEST(Robot, WarnsOfALargeLoad) {
  const Phantom phantom = broken({0, 0, 0}, {0, 0, -10});
  const auto warns = [&](double up_mm) {
    return move(phantom, gripped(phantom, kStraight), shift(0, 0, up_mm)).at("report").as<RobotReport>().is_warning;
  };
  EXPECT_FALSE(warns(2));
  EXPECT_TRUE(warns(-8));
}

TEST(Robot, RefusesWhatItCannotGrip) {
  const std::string text = refusal("robot.hexapod", {{"phantom", item(broken({0, 0, 0}, {0, 0, 12}))}});
  EXPECT_FRAME(text, "robot.hexapod: the force on the fragment is already ",
               "its limit is 400 N; does its bone stick in the other fragment? Begin with the fragments apart");
  EXPECT_EQ(
      refusal("robot.hexapod", {{"phantom", item(broken({0, 0, 0}, {0, 0, -5}))}},
              {{"moved", "proximal"}, {"reference", "distal"}}),
      "robot.hexapod: the robot holds the distal fragment, and the proximal one stays; got 'proximal' and 'distal'");
  Phantom whole = broken({0, 0, 0}, {0, 0, -5});
  whole.fracture = {};
  EXPECT_EQ(refusal("robot.hexapod", {{"phantom", item(whole)}}),
            "robot.hexapod: fragment 'proximal' lies on one side of a fracture, but there is no fracture surface");
}

TEST(RelativePose, ItsDeviationCountsBothPosesAndTheLever) {
  Pose distal, proximal;
  distal.frame.origin_mm = {0, 0, -100};
  proximal.frame.origin_mm = {0, 0, 100};
  distal.frame.axes = proximal.frame.axes = Matrix3d::Identity();
  distal.covariance = Matrix6d::Zero();
  Matrix6d of_proximal = Matrix6d::Zero();
  of_proximal(0, 0) = 1e-6;  // 1 mrad about x, 200 mm away
  proximal.covariance = of_proximal;
  const guide::RelativePose relative = guide::relative_pose(distal, proximal);
  EXPECT_NEAR(guide::shift_deviation_mm(relative.covariance), 0.2, 1e-9);
  EXPECT_NEAR(guide::rotation_deviation_rad(relative.covariance), 1e-3, 1e-12);
  distal.covariance.reset();
  EXPECT_TRUE(std::isinf(guide::shift_deviation_mm(guide::relative_pose(distal, proximal).covariance)));
}

// The kinematics of a hexapod against lengths computed by hand, and against each other.

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
  EXPECT_EQ(MESSAGE_OF(robot::check_workspace(hexapod, {60, 40}, pose({0, 0, 0}, {0, 0, 500}), "motion 'up'")),
            "motion 'up' is outside the hexapod's workspace: leg 1 would be 565.7 mm long, its limits are 419.6 mm and "
            "539.6 mm; give a smaller motion");
  EXPECT_EQ(MESSAGE_OF(robot::check_workspace(hexapod, {60, 5}, pose({0, 0, 20}, {0, 0, 400}), "motion 'turn'")),
            "motion 'turn' is outside the hexapod's workspace: leg 1 would turn by 12.5 degrees in its joint, its "
            "limit is 5.0 degrees; give a smaller motion");
  EXPECT_EQ(MESSAGE_OF(robot::check_workspace(hexapod, {60, 40}, hexapod.base_from_home, "home")), "");
}

TEST(Hexapod, LengthsWithoutAPoseAreRefused) {
  const Hexapod hexapod = simple();
  Vector6d lengths = robot::leg_lengths_mm(hexapod, hexapod.base_from_home);
  lengths[0] = 100000;
  EXPECT_HAS(MESSAGE_OF(robot::pose_of_legs(hexapod, lengths, hexapod.base_from_home)),
             "no pose of the platform near the start has these lengths of the legs");
  lengths[0] = NAN;
  EXPECT_EQ(MESSAGE_OF(robot::pose_of_legs(hexapod, lengths, hexapod.base_from_home)),
            "the lengths of the hexapod's legs are not all numbers");
}

TEST(Hexapod, LegsInOneLineWithTheirPlatformDoNotHoldIt) {
  // A platform as large as its base, with parallel legs, is free to swing.
  Hexapod hexapod = simple();
  hexapod.platform_mm = hexapod.base_mm;
  Vector6d lengths = robot::leg_lengths_mm(hexapod, hexapod.base_from_home);
  lengths[0] += 1;
  EXPECT_EQ(MESSAGE_OF(robot::pose_of_legs(hexapod, lengths, hexapod.base_from_home)),
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

}  // namespace marrow::test::robot_test
