// SPDX-License-Identifier: Apache-2.0
// A hexapod is fixed beside the patient and grips the distal fragment. Its place is known only roughly.

#include "marrow/robot/contact.hpp"

namespace {

using namespace marrow;
using robot::Held, robot::RobotReport, robot::RobotState;

struct Options : robot::HexapodShape, robot::HexapodLimits, robot::RobotErrors, robot::SoftTissue, robot::ForceLimits {
  Options() {
    base_radius_mm = 250, platform_radius_mm = 150, height_mm = 350;
    stroke_mm = 130, joint_deg = 60;
  }
  std::string moved = "distal", reference = "proximal";
  double held_at_mm = 120;
  Eigen::Vector3d stand_off_deg{6, -5, 6}, stand_off_mm{29, -29, 29};
};

struct Result {
  RobotState state;
  RobotReport report;
};

RobotState state_of(const Options& options) {
  RobotState state;
  state.fragment = options.moved, state.reference = options.reference;
  state.shape = options, state.limits = options, state.errors = options, state.tissue = options, state.force = options;
  return state;
}

Result hexapod(const phantom::Phantom& phantom, const Options& options, Context& context) {
  const std::string what = "robot.hexapod";
  phantom::check_phantom(phantom, what);
  const Held held(phantom, options, options.moved, options.reference, what);
  const phantom::Fragment& fragment = held.fragment();
  const Eigen::Vector3d middle_mm = fragment.world_from_ct * fragment.frame.origin_mm;
  Result result{state_of(options), {}};
  RobotState& state = result.state;
  // As planned, the base's axes are those of the world, and the fragment's middle lies above the platform at home.
  const robot::Hexapod nominal = robot::make_hexapod(options);
  robot::check_workspace(nominal, options, nominal.base_from_home, what + ": home");
  const double condition = robot::condition(nominal, nominal.base_from_home);
  if (const std::string text = robot::doubtful_condition(condition, "home"); !text.empty()) context.warn(text);
  state.base_from_platform = nominal.base_from_home;
  RigidTransform planned{"base", "world"};
  planned.translation_mm = nominal.base_from_home * Eigen::Vector3d(0, 0, options.held_at_mm) - middle_mm;
  FragmentFrame at_middle;
  at_middle.origin_mm = middle_mm;
  at_middle.axes.setIdentity();
  Vector6d off;
  off << radians(1) * options.stand_off_deg, options.stand_off_mm;
  state.world_from_base = inverse(moved(planned, at_middle, off));
  result.report.robot_from_world = {"robot", "world", planned.rotation, planned.translation_mm};
  // It grips the fragment where it is.
  const RigidTransform platform =
      robot::pose_of_legs(robot::as_built(nominal, options.joint_sd_mm, options.robot_seed),
                          robot::leg_lengths_mm(nominal, nominal.base_from_home), nominal.base_from_home)
          .base_from_platform;
  state.platform_from_ct = inverse(state.world_from_base * platform) * fragment.world_from_ct;
  state.world_from_ct = fragment.world_from_ct;
  state.load_at_grip = held.load_at(fragment.world_from_ct);
  if (state.load_at_grip.force_n > options.stop_above_n) {
    const std::string text =
        formatted("{:.0f} N, its limit is {:.0f} N", state.load_at_grip.force_n, options.stop_above_n);
    throw Error(what + ": the force on the fragment is already " + text +
                "; does its bone stick in the other fragment? Begin with the fragments apart");
  }
  result.report.load = result.report.largest_load = state.largest_load = state.load_at_grip;
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("robot.hexapod", hexapod);
  node.summary("A hexapod grips the distal fragment; its place, its joints and the soft tissue are not known exactly")
      .in("phantom", "fractured bone")
      .out("state", &Result::state, "the robot, with what only the simulation knows")
      .out("report", &Result::report, "what the robot says: its place as planned, and the load")
      .option("moved", &Options::moved, "name of the fragment that it holds: the distal one")
      .option("reference", &Options::reference, "name of the fragment that stays: the proximal one");
  robot::declare_hexapod<Options>(node)
      .option("held_at_mm", &Options::held_at_mm, "distance from the platform's middle to the fragment's", at_least(0))
      .option("stand_off_deg", &Options::stand_off_deg,
              "how far the robot is turned from where it is planned to stand, about the fragment's middle")
      .option("stand_off_mm", &Options::stand_off_mm, "how far it is shifted from there")
      .option("leg_sd_mm", &Options::leg_sd_mm, "standard deviation of each leg's length, drawn for each motion",
              at_least(0))
      .option("joint_sd_mm", &Options::joint_sd_mm,
              "standard deviation of each coordinate of each joint, drawn once for the robot", at_least(0))
      .option("robot_seed", &Options::robot_seed, "seed of the joints' and the legs' errors", at_least(0))
      .option("give_mm_per_n", &Options::give_mm_per_n, "how far it yields to a force", at_least(0), unit("mm/N"))
      .option("give_deg_per_nm", &Options::give_deg_per_nm, "how far it yields to a torque", at_least(0),
              unit("deg/Nm"))
      .option("tone_n", &Options::tone_n, "muscles' pull along the shaft at the bone's right length", at_least(0),
              unit("N"))
      .option("stretch_mm", &Options::stretch_mm, "each such lengthening multiplies this pull by 2.718", at_least(1))
      .option("side_n_per_mm", &Options::side_n_per_mm, "force against a shift across the shaft", at_least(0),
              unit("N/mm"))
      .option("turn_nm_per_deg", &Options::turn_nm_per_deg, "torque against a rotation", at_least(0), unit("Nm/deg"))
      .option("bone_n_per_mm", &Options::bone_n_per_mm, "force for each mm by which the bones are pressed together",
              at_least(0), unit("N/mm"))
      .option("warn_above_n", &Options::warn_above_n, "a larger force is a warning", at_least(0), unit("N"))
      .option("warn_above_nm", &Options::warn_above_nm, "a larger torque is a warning", at_least(0), unit("Nm"))
      .option("stop_above_n", &Options::stop_above_n, "the robot stops before a larger force", at_least(0), unit("N"))
      .relation(not_above("warn_above_n", "stop_above_n"));
}
