// SPDX-License-Identifier: Apache-2.0
// How well a hexapod's legs hold its platform: the condition of their Jacobian against numpy, and who looks at it.
#include "marrow/toolbox/robotics/hexapod.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::condition_test {

using robot::Hexapod;
using test::message_of;

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
    return message_of([&] {
      robot::check_workspace(hexapod, {1000, 180}, pose({0, 0, turn_deg}, {0, 0, 220}), "motion 'turn'");
    });
  };
  EXPECT_EQ(refused(88), "");
  // A turn by a quarter is singular for any hexapod of this kind (Fichter 1986). Beyond it the legs hold the platform
  // again, but the platform cannot get there.
  EXPECT_TRUE(refused(90).starts_with("motion 'turn': the hexapod's legs do not hold the platform in this pose: "))
      << refused(90);
  EXPECT_TRUE(refused(90).ends_with(", at most 100 is allowed; give another motion, or another shape of the hexapod"))
      << refused(90);
  EXPECT_EQ(refused(100),
            "motion 'turn': the hexapod cannot come from home to this pose: on the way its legs pass a singular pose, "
            "where they do not hold the platform; give a smaller motion");
}

TEST(HexapodCondition, NoPoseIsFoundWhereTheLegsDoNotHoldThePlatform) {
  // Base and platform with joints at the same angles: the legs hold the platform nowhere.
  const Hexapod free = robot::make_hexapod({150, 90, 60, 60, 220});
  Vector6d lengths = robot::leg_lengths_mm(free, free.base_from_home);
  lengths[0] += 0.02;
  EXPECT_EQ(message_of([&] { robot::pose_of_legs(free, lengths, free.base_from_home); }),
            "the hexapod's legs do not hold the platform in this pose: the pose is singular, at most 100 is allowed; "
            "give another motion, or another shape of the hexapod");
  // The joints' errors make it regular, but not better.
  EXPECT_TRUE(
      message_of([&] {
        robot::pose_of_legs(robot::as_built(free, 0.05, 1), lengths, free.base_from_home);
      }).starts_with("the hexapod's legs do not hold the platform in this pose: the condition of its legs is "));
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
  List<Pose> commands;
  commands.add("stays", shifted(0));
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
  EXPECT_TRUE(
      heard.warnings[0].starts_with("home comes near a singular pose of the hexapod: the condition of its legs is "))
      << heard.warnings[0];
}

}  // namespace marrow::test::condition_test
