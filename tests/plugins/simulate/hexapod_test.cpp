// SPDX-License-Identifier: Apache-2.0
// A fragment on a hexapod: the commands, its true pose, and how far the errors move it.
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::hexapod_test {

using namespace simulated;

const Phantom& broken() {
  static const Phantom made = fracture(femur(), {{"height_fraction", 0.4}});
  return made;
}
List<Pose> sweeps(const Options& options = {{"turn_step_deg", 15.0}}) {
  return output_list<Pose>("simulate.sweeps", "commands", {}, options);
}

Inputs commanded(const List<Pose>& commands) {
  return {{"phantom", item(broken())}, {"commands", list(commands, "position")}};
}
/// Without errors but for those of the options.
Outputs hexapod(const List<Pose>& commands, const Options& options = {}, std::uint64_t seed = 1) {
  return call("simulate.hexapod", commanded(commands),
              with({{"leg_sd_mm", 0.0}, {"joint_sd_mm", 0.0}, {"mount_sd_deg", 0.0}, {"mount_sd_mm", 0.0}}, options),
              Context(seed));
}
List<Truth> truths(const Outputs& made, const std::string& port = "platform") { return made.at(port).as_list<Truth>(); }

/// Errors of the platform's motions from the first position, in degrees and mm, root mean square.
std::array<double, 2> errors(const Options& options) {
  const List<Pose> commands = sweeps({});
  const List<Truth> found = truths(hexapod(commands, options)), exact = truths(hexapod(commands));
  double turn2 = 0, shift2 = 0;
  for (std::size_t i = 1; i < found.size(); ++i) {
    const auto motion = [&](const List<Truth>& list) {
      return inverse(list[0].world_from_model) * list[i].world_from_model;
    };
    const RigidTransform error = inverse(motion(exact)) * motion(found);
    turn2 += std::pow(degrees(vector_from_rotation(error.rotation).norm()), 2);
    shift2 += error.translation_mm.squaredNorm();
  }
  return {std::sqrt(turn2 / double(found.size() - 1)), std::sqrt(shift2 / double(found.size() - 1))};
}

TEST(SimulateSweeps, BeginAtNeutralAndGoFromThereToEitherSide) {
  EXPECT_EQ(sweeps({}).size(), 94u);  // 3 x 31 and the neutral one
  const List<Pose> commands = sweeps({{"axes", Strings{"y"}}, {"max_rotation_deg", 5.0}, {"turn_step_deg", 2.5}});
  EXPECT_EQ(commands.names(), (Strings{"neutral", "ry+00.00", "ry+02.50", "ry+05.00", "ry-02.50", "ry-05.00"}));
  const RigidTransform& last = commands[5].world_from_model;
  EXPECT_NEAR(degrees(vector_from_rotation(last.rotation).y()), -5, 1e-9);
  EXPECT_LT((last * Vector3d(0, 0, 90) - Vector3d(0, 0, 90)).norm(), 1e-9);
}

TEST(SimulateSweeps, NamesTellAllStepsApart) {
  const auto names = [](double range_deg, double step_deg) {
    return sweeps({{"axes", Strings{"z"}}, {"max_rotation_deg", range_deg}, {"turn_step_deg", step_deg}}).names();
  };
  EXPECT_EQ(names(0.03, 0.015), (Strings{"neutral", "rz+00.000", "rz+00.015", "rz+00.030", "rz-00.015", "rz-00.030"}));
  EXPECT_EQ(names(0.5, 0.5), (Strings{"neutral", "rz+00.00", "rz+00.50", "rz-00.50"}));
  EXPECT_EQ(names(1, 1.0 / 3)[2], "rz+00.333333");
}

TEST(SimulateHexapod, WithoutErrorsItDoesWhatItIsTold) {
  const List<Pose> commands = sweeps({{"max_rotation_deg", 15.0}, {"turn_step_deg", 15.0}});
  const Outputs made = hexapod(commands);
  const List<Truth> platform = truths(made), fragment = truths(made, "fragment");
  const RigidTransform home = platform[0].world_from_model,
                       platform_from_ct = inverse(home) * fragment[0].world_from_model;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const RigidTransform motion = inverse(home) * platform[i].world_from_model,
                         mounted = inverse(platform[i].world_from_model) * fragment[i].world_from_model;
    EXPECT_LT((motion.rotation - commands[i].world_from_model.rotation).norm(), 1e-9) << commands.name(i);
    EXPECT_LT(shift_between_mm(motion, commands[i].world_from_model), 1e-7);
    EXPECT_LT((mounted.rotation - platform_from_ct.rotation).norm(), 1e-9);
    EXPECT_LT(shift_between_mm(mounted, platform_from_ct), 1e-7);
  }
  EXPECT_LT((made.at("start").as<Pose>().world_from_model.rotation - fragment[0].world_from_model.rotation).norm(),
            1e-9);
  // The fragment stands on its fracture, with its middle at the given place.
  const Fragment& distal = phantom::distal_fragment(broken());
  EXPECT_LT((fragment[0].world_from_model * distal.frame.origin_mm - Vector3d(3, -4, 5)).norm(), 1e-7);
  double lowest = 1e9;
  for (const auto& triangle : distal.outer.triangles)
    for (const auto corner : triangle)
      lowest = std::min(lowest, (platform_from_ct * distal.outer.vertices_mm[corner]).z());
  EXPECT_NEAR(lowest, 5, 1e-9);
  EXPECT_NEAR((platform_from_ct.rotation * distal.frame.axes.col(2)).z(), -1, 1e-9);
}

TEST(SimulateHexapod, ErrorsMoveThePlatformByAsMuchAsTheyShould) {
  // Legs of 0.02 mm: 0.01 to 0.02 degrees at each end of the motion; joints of 0.05 mm: 0.007 degrees, because most of
  // their error is the same at home; both of 0.1 mm: 0.08 degrees.
  const auto legs = errors({{"leg_sd_mm", 0.02}}), joints = errors({{"joint_sd_mm", 0.05}}),
             both = errors({{"leg_sd_mm", 0.1}, {"joint_sd_mm", 0.1}});
  EXPECT_GT(legs[0], 0.012);
  EXPECT_LT(legs[0], 0.035);
  EXPECT_GT(joints[0], 0.002);
  EXPECT_LT(joints[0], 0.02);
  EXPECT_GT(both[0], 0.05);
  EXPECT_LT(both[0], 0.16);
  EXPECT_GT(both[1], 0.08);
  EXPECT_LT(both[1], 0.5);
}

TEST(SimulateHexapod, AHexapodKeepsItsJointsAndARunItsMounting) {
  const List<Pose> commands = sweeps();
  const auto platform = [&](const Options& options, std::uint64_t seed) {
    return truths(hexapod(commands, options, seed))[1].world_from_model.translation_mm;
  };
  EXPECT_EQ(platform({{"joint_sd_mm", 0.05}}, 1), platform({{"joint_sd_mm", 0.05}}, 2));
  EXPECT_NE(platform({{"joint_sd_mm", 0.05}}, 1),
            platform({{"joint_sd_mm", 0.05}, {"platform_seed", std::int64_t(2)}}, 1));
  EXPECT_NE(platform({{"leg_sd_mm", 0.05}}, 1), platform({{"leg_sd_mm", 0.05}}, 2));
  const auto mounted = [&](std::uint64_t seed, std::size_t i) {
    const Outputs made = hexapod(commands, {{"mount_sd_deg", 2.0}}, seed);
    return inverse(truths(made)[i].world_from_model) * truths(made, "fragment")[i].world_from_model;
  };
  EXPECT_LT((mounted(1, 0).rotation - mounted(1, 3).rotation).norm(), 1e-9);
  EXPECT_GT(turn_between_deg(mounted(1, 0), mounted(2, 0)), 0.5);
  EXPECT_LT(turn_between_deg(mounted(1, 0), mounted(2, 0)), 15);
}

TEST(SimulateHexapod, SaysTheLengthsOfItsLegs) {
  const auto legs = hexapod(sweeps()).at("legs").as_list<Metrics>();
  // At home: from 150 (cos 12, -sin 12) to 90 (cos 48, -sin 48), 220 mm higher.
  EXPECT_NEAR(figure(item(legs[0]), "leg1"),
              std::hypot(std::hypot(150 * std::cos(radians(12)) - 90 * std::cos(radians(48)),
                                    150 * std::sin(radians(12)) - 90 * std::sin(radians(48))),
                         220),
              1e-9);
}

TEST(SimulateHexapod, RefusesWhatItCannotDo) {
  const std::string text = refusal("simulate.hexapod", commanded(sweeps()), {{"stroke_mm", 10.0}});
  EXPECT_TRUE(
      text.starts_with("simulate.hexapod: motion 'rx+15.00' is outside the hexapod's workspace: leg 1 would be "))
      << text;
  EXPECT_EQ(refusal("simulate.hexapod", commanded(sweeps()), {{"fragment", "middle"}}),
            "simulate.hexapod: the phantom has no fragment 'middle', only proximal, distal");
}

}  // namespace marrow::test::hexapod_test
