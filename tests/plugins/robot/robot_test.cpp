// SPDX-License-Identifier: Apache-2.0
// A simulated robot that holds the distal fragment of a fractured femur.
#include "marrow/guide/relative_pose.hpp"
#include "marrow/robot/contact.hpp"
#include "marrow/toolbox/robotics/robot_state.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::robot_test {

using phantom::Phantom;
using robot::RobotReport;
using robot::RobotState;

const phantom::Bone& femur() {
  static const phantom::Bone made = simulated::femur({});
  return made;
}

Phantom broken(Numbers rotation_deg, Numbers translation_mm) {
  return simulated::fracture(femur(), {{"rotation_deg", rotation_deg}, {"translation_mm", translation_mm}});
}

const Options kExact{{"leg_sd_mm", 0.0}, {"joint_sd_mm", 0.0}, {"give_mm_per_n", 0.0}, {"give_deg_per_nm", 0.0}};

Outputs gripped(const Phantom& phantom, Options options = kExact) {
  return call("robot.hexapod", {{"phantom", item(phantom)}}, options);
}

Outputs move(const Phantom& phantom, const Outputs& before, const RigidTransform& motion) {
  Pose told;
  told.world_from_model = motion;
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
  EXPECT_EQ(message_of([&] { robot::Contact(Phantom{}, "test"); }),
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
  Options options = kExact;
  options["stand_off_deg"] = Numbers{0, 0, 90};
  options["stand_off_mm"] = Numbers{0, 0, 0};
  const Outputs before = gripped(phantom, options), after = move(phantom, before, shift(3, 0, 0));
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
  Options options = kExact;
  options["stand_off_deg"] = options["stand_off_mm"] = Numbers{0, 0, 0};
  const Outputs after = move(phantom, gripped(phantom, options), shift(0, 0, 30));
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
  Options options = kExact;
  options["stroke_mm"] = 3.0;
  const RobotReport report = move(phantom, gripped(phantom, options), shift(12, 0, 0)).at("report").as<RobotReport>();
  EXPECT_TRUE(report.stopped.starts_with("the motion is outside the hexapod's workspace: leg ")) << report.stopped;
  EXPECT_FALSE(report.is_pressed);
}

TEST(Robot, WarnsOfALargeLoad) {
  const Phantom phantom = broken({0, 0, 0}, {0, 0, -10});
  Options options = kExact;
  options["stand_off_deg"] = options["stand_off_mm"] = Numbers{0, 0, 0};
  EXPECT_FALSE(move(phantom, gripped(phantom, options), shift(0, 0, 2)).at("report").as<RobotReport>().is_warning);
  EXPECT_TRUE(move(phantom, gripped(phantom, options), shift(0, 0, -8)).at("report").as<RobotReport>().is_warning);
}

TEST(Robot, RefusesWhatItCannotGrip) {
  const std::string text = refusal("robot.hexapod", {{"phantom", item(broken({0, 0, 0}, {0, 0, 12}))}});
  EXPECT_TRUE(text.starts_with("robot.hexapod: the force on the fragment is already ")) << text;
  EXPECT_TRUE(
      text.ends_with("its limit is 400 N; does its bone stick in the other fragment? Begin with the fragments apart"))
      << text;
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

}  // namespace marrow::test::robot_test
