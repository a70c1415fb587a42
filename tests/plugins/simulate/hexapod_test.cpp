// SPDX-License-Identifier: Apache-2.0
// A fragment on a hexapod: the commands, its true pose, and how far the errors move it.
#include <gtest/gtest.h>

#include "nodes.hpp"

namespace hexapod_test {

using namespace marrow;
using phantom::Phantom;

const Phantom& broken() {
  static const Phantom made = simulated::fracture(simulated::femur({}), {{"height_fraction", 0.4}});
  return made;
}

List<Pose> sweeps(const shipped::Options& options) {
  return shipped::call("simulate.sweeps", {}, options).at("commands").as_list<Pose>();
}

const shipped::Options kExact{{"leg_sd_mm", 0.0}, {"joint_sd_mm", 0.0}, {"mount_sd_deg", 0.0}, {"mount_sd_mm", 0.0}};

shipped::Outputs hexapod(const List<Pose>& commands, shipped::Options options, std::uint64_t seed = 1) {
  for (const auto& [name, value] : kExact) options.emplace(name, value);
  return shipped::call("simulate.hexapod",
                       {{"phantom", shipped::item(broken())}, {"commands", shipped::list(commands, "position")}},
                       options, Context(seed));
}

/// Errors of the platform's motions from the first position, in degrees and mm, root mean square.
std::array<double, 2> errors(const shipped::Outputs& made, const List<Pose>& commands) {
  const auto found = made.at("platform").as_list<Truth>(),
             exact = hexapod(commands, {}).at("platform").as_list<Truth>();
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
  const List<Pose> all = sweeps({});
  EXPECT_EQ(all.size(), 94u);  // 3 x 31 and the neutral one
  const List<Pose> commands =
      sweeps({{"axes", std::vector<std::string>{"y"}}, {"max_rotation_deg", 5.0}, {"turn_step_deg", 2.5}});
  EXPECT_EQ(commands.names(),
            (std::vector<std::string>{"neutral", "ry+00.00", "ry+02.50", "ry+05.00", "ry-02.50", "ry-05.00"}));
  const RigidTransform& last = commands[5].world_from_model;
  EXPECT_NEAR(degrees(vector_from_rotation(last.rotation).y()), -5, 1e-9);
  EXPECT_LT((last * Eigen::Vector3d(0, 0, 90) - Eigen::Vector3d(0, 0, 90)).norm(), 1e-9);
}

TEST(SimulateSweeps, NamesTellAllStepsApart) {
  const auto names = [](double range_deg, double step_deg) {
    return sweeps(
               {{"axes", std::vector<std::string>{"z"}}, {"max_rotation_deg", range_deg}, {"turn_step_deg", step_deg}})
        .names();
  };
  EXPECT_EQ(names(0.03, 0.015),
            (std::vector<std::string>{"neutral", "rz+00.000", "rz+00.015", "rz+00.030", "rz-00.015", "rz-00.030"}));
  EXPECT_EQ(names(0.5, 0.5), (std::vector<std::string>{"neutral", "rz+00.00", "rz+00.50", "rz-00.50"}));
  EXPECT_EQ(names(1, 1.0 / 3)[2], "rz+00.333333");
}

TEST(SimulateHexapod, WithoutErrorsItDoesWhatItIsTold) {
  const List<Pose> commands = sweeps({{"max_rotation_deg", 15.0}, {"turn_step_deg", 15.0}});
  const auto made = hexapod(commands, {});
  const auto platform = made.at("platform").as_list<Truth>(), fragment = made.at("fragment").as_list<Truth>();
  const RigidTransform& home = platform[0].world_from_model;
  const RigidTransform platform_from_ct = inverse(home) * fragment[0].world_from_model;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const RigidTransform motion = inverse(home) * platform[i].world_from_model;
    EXPECT_LT((motion.rotation - commands[i].world_from_model.rotation).norm(), 1e-9) << commands.name(i);
    EXPECT_LT((motion.translation_mm - commands[i].world_from_model.translation_mm).norm(), 1e-7);
    const RigidTransform mounted = inverse(platform[i].world_from_model) * fragment[i].world_from_model;
    EXPECT_LT((mounted.rotation - platform_from_ct.rotation).norm(), 1e-9);
    EXPECT_LT((mounted.translation_mm - platform_from_ct.translation_mm).norm(), 1e-7);
  }
  EXPECT_LT((made.at("start").as<Pose>().world_from_model.rotation - fragment[0].world_from_model.rotation).norm(),
            1e-9);
  // The fragment stands on its fracture, with its middle at the given place.
  const phantom::Fragment* distal = nullptr;
  for (const auto& one : broken().fragments)
    if (one.name == "distal") distal = &one;
  EXPECT_LT((fragment[0].world_from_model * distal->frame.origin_mm - Eigen::Vector3d(3, -4, 5)).norm(), 1e-7);
  double lowest = 1e9;
  for (const auto& triangle : distal->outer.triangles)
    for (const auto corner : triangle)
      lowest = std::min(lowest, (platform_from_ct * distal->outer.vertices_mm[corner]).z());
  EXPECT_NEAR(lowest, 5, 1e-9);
  EXPECT_NEAR((platform_from_ct.rotation * distal->frame.axes.col(2)).z(), -1, 1e-9);
}

TEST(SimulateHexapod, ErrorsMoveThePlatformByAsMuchAsTheyShould) {
  const List<Pose> commands = sweeps({});
  // Legs of 0.02 mm: 0.01 to 0.02 degrees at each end of the motion; joints of 0.05 mm: 0.007 degrees, because most of
  // their error is the same at home; both of 0.1 mm: 0.08 degrees.
  const auto legs = errors(hexapod(commands, {{"leg_sd_mm", 0.02}}), commands);
  EXPECT_GT(legs[0], 0.012);
  EXPECT_LT(legs[0], 0.035);
  const auto joints = errors(hexapod(commands, {{"joint_sd_mm", 0.05}}), commands);
  EXPECT_GT(joints[0], 0.002);
  EXPECT_LT(joints[0], 0.02);
  const auto both = errors(hexapod(commands, {{"leg_sd_mm", 0.1}, {"joint_sd_mm", 0.1}}), commands);
  EXPECT_GT(both[0], 0.05);
  EXPECT_LT(both[0], 0.16);
  EXPECT_GT(both[1], 0.08);
  EXPECT_LT(both[1], 0.5);
}

TEST(SimulateHexapod, AHexapodKeepsItsJointsAndARunItsMounting) {
  const List<Pose> commands = sweeps({{"turn_step_deg", 15.0}});
  const auto platform = [&](const shipped::Options& options, std::uint64_t seed) {
    return hexapod(commands, options, seed).at("platform").as_list<Truth>()[1].world_from_model.translation_mm;
  };
  EXPECT_EQ(platform({{"joint_sd_mm", 0.05}}, 1), platform({{"joint_sd_mm", 0.05}}, 2));
  EXPECT_NE(platform({{"joint_sd_mm", 0.05}}, 1),
            platform({{"joint_sd_mm", 0.05}, {"platform_seed", std::int64_t(2)}}, 1));
  EXPECT_NE(platform({{"leg_sd_mm", 0.05}}, 1), platform({{"leg_sd_mm", 0.05}}, 2));
  const auto mounted = [&](std::uint64_t seed, std::size_t i) {
    const auto made = hexapod(commands, {{"mount_sd_deg", 2.0}}, seed);
    return (inverse(made.at("platform").as_list<Truth>()[i].world_from_model) *
            made.at("fragment").as_list<Truth>()[i].world_from_model)
        .rotation;
  };
  EXPECT_LT((mounted(1, 0) - mounted(1, 3)).norm(), 1e-9);
  const double turn = degrees(geodesic_angle_rad(mounted(1, 0), mounted(2, 0)));
  EXPECT_GT(turn, 0.5);
  EXPECT_LT(turn, 15);
}

TEST(SimulateHexapod, SaysTheLengthsOfItsLegs) {
  const auto legs = hexapod(sweeps({{"turn_step_deg", 15.0}}), {}).at("legs").as_list<Metrics>();
  // At home: from 150 (cos 12, -sin 12) to 90 (cos 48, -sin 48), 220 mm higher.
  EXPECT_NEAR(shipped::figure(shipped::item(legs[0]), "leg1"),
              std::hypot(std::hypot(150 * std::cos(radians(12)) - 90 * std::cos(radians(48)),
                                    150 * std::sin(radians(12)) - 90 * std::sin(radians(48))),
                         220),
              1e-9);
}

TEST(SimulateHexapod, RefusesWhatItCannotDo) {
  const List<Pose> commands = sweeps({{"turn_step_deg", 15.0}});
  const shipped::Inputs inputs{{"phantom", shipped::item(broken())}, {"commands", shipped::list(commands, "position")}};
  const std::string text = shipped::refusal("simulate.hexapod", inputs, {{"stroke_mm", 10.0}});
  EXPECT_TRUE(
      text.starts_with("simulate.hexapod: motion 'rx+15.00' is outside the hexapod's workspace: leg 1 would be "))
      << text;
  EXPECT_EQ(shipped::refusal("simulate.hexapod", inputs, {{"fragment", "middle"}}),
            "simulate.hexapod: the phantom has no fragment 'middle', only proximal, distal");
}

}  // namespace hexapod_test
