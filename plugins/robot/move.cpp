// SPDX-License-Identifier: Apache-2.0
// A robot makes a motion in small parts. It stops before a force that is too large, and where it cannot go on.

#include "marrow/domain/random.hpp"
#include "marrow/robot/contact.hpp"

namespace {

using namespace marrow;
using robot::Held, robot::Hexapod, robot::Load, robot::RobotReport, robot::RobotState;

struct Result {
  RobotState state;
  RobotReport report;
  Metrics metrics;
};

std::string with_unit(double value, const char* unit) { return formatted("{:.0f} {}", value, unit); }

/// Where the held fragment is while the encoders say `base_from_platform`.
class Robot {
 public:
  Robot(const RobotState& state, const phantom::Phantom& phantom, std::uint64_t seed)
      : state_(state),
        nominal_(robot::make_hexapod(state.shape)),
        built_(robot::as_built(nominal_, state.errors.joint_sd_mm, state.errors.robot_seed)),
        held_(phantom, state.tissue, state.fragment, state.reference, "robot.move") {
    marrow::Random random(seed + std::uint64_t(state.errors.robot_seed), std::uint64_t(state.moves) + 1);
    for (int k = 0; k < 6; ++k) leg_error_mm_[k] = state.errors.leg_sd_mm * random.normal();
  }

  const Hexapod& nominal() const { return nominal_; }
  const Held& held() const { return held_; }

  RigidTransform world_from_ct(const RigidTransform& base_from_platform) const {
    const Vector6d lengths = robot::leg_lengths_mm(nominal_, base_from_platform) + leg_error_mm_;
    const RigidTransform stiff = state_.world_from_base *
                                 robot::pose_of_legs(built_, lengths, base_from_platform).base_from_platform *
                                 state_.platform_from_ct;
    // It yields towards the fragment's right place: that is where the load pulls.
    const Load load = held_.load_at(stiff);
    const phantom::Fragment& fragment = held_.fragment();
    Vector6d yields = Vector6d::Zero();
    yields[5] = state_.errors.give_mm_per_n * (load.force_n - state_.load_at_grip.force_n);
    yields[0] = radians(state_.errors.give_deg_per_nm) * (load.torque_nm - state_.load_at_grip.torque_nm);
    return moved(stiff, fragment.frame, yields);
  }

 private:
  const RobotState& state_;
  Hexapod nominal_, built_;
  Held held_;
  Vector6d leg_error_mm_;
};

/// The part of a motion that is done after `share` of it: turned evenly, and a point of the hand moved straight.
RigidTransform part_of(const RigidTransform& motion, const Eigen::Vector3d& hand_mm, double share) {
  RigidTransform part = motion;
  part.rotation = rotation_from_vector(share * vector_from_rotation(motion.rotation));
  part.translation_mm = hand_mm + share * (motion * hand_mm - hand_mm) - part.rotation * hand_mm;
  return part;
}

Metrics figures_of(const RobotReport& report, const Load& largest) {
  return {{{"force_n", report.load.force_n, "N"},
           {"torque_nm", report.load.torque_nm, "Nm"},
           {"largest_force_n", largest.force_n, "N"},
           {"largest_torque_nm", largest.torque_nm, "Nm"},
           {"warned", double(report.is_warning), ""},
           {"stopped", double(!report.stopped.empty()), ""}}};
}

Result move(const phantom::Phantom& phantom, const RobotState& state, const Pose& motion, const RobotReport& before,
            Context& context) {
  check_rigid(motion.world_from_model, "the motion");
  RigidTransform told = motion.world_from_model;
  told.target = told.source = "base";
  const Robot robot(state, phantom, context.seed());
  const Eigen::Vector3d hand_mm = state.base_from_platform.translation_mm;
  const double turn_deg = degrees(vector_from_rotation(told.rotation).norm()),
               way_mm = (told * hand_mm - hand_mm).norm();
  const int parts = int(std::ceil(std::max({turn_deg / 0.5, way_mm / 0.5, 1.0})));
  Result result{state, before, {}};
  result.report.stopped.clear();
  result.report.is_pressed = false;
  RigidTransform at = state.world_from_ct;
  Load load = robot.held().load_at(at);
  result.report.largest_load = load;
  double worst = 0;
  const bool is_motion = turn_deg > 1e-9 || way_mm > 1e-9;
  for (int i = 1; i <= parts && is_motion; ++i) {
    context.check_cancelled();
    const RigidTransform platform = part_of(told, hand_mm, double(i) / parts) * state.base_from_platform;
    RigidTransform next;
    try {
      robot::check_workspace(robot.nominal(), state.limits, platform, "the motion");
      next = robot.world_from_ct(platform);
    } catch (const Error& error) {
      result.report.stopped = error.what();
      break;
    }
    const Load there = robot.held().load_at(next);
    if (there.force_n > state.force.stop_above_n && there.force_n > load.force_n) {
      result.report.stopped = "the force would pass " + with_unit(state.force.stop_above_n, "N");
      result.report.is_pressed = true;
      break;
    }
    at = next, load = there;
    worst = std::max(worst, robot::condition(robot.nominal(), platform));
    result.state.base_from_platform = platform;
    result.report.largest_load.force_n = std::max(result.report.largest_load.force_n, load.force_n);
    result.report.largest_load.torque_nm = std::max(result.report.largest_load.torque_nm, load.torque_nm);
  }
  result.state.world_from_ct = at;
  ++result.state.moves;
  RobotReport& report = result.report;
  report.done = result.state.base_from_platform * inverse(state.base_from_platform);
  report.done.target = report.done.source = "robot";
  report.load = load;
  report.is_warning = report.largest_load.force_n > state.force.warn_above_n ||
                      report.largest_load.torque_nm > state.force.warn_above_nm;
  if (report.is_warning)
    context.warn("the load is large: " + with_unit(report.largest_load.force_n, "N") + " (warning at " +
                 with_unit(state.force.warn_above_n, "N") + "), " + with_unit(report.largest_load.torque_nm, "Nm"));
  if (!report.stopped.empty()) context.warn("the robot stopped: " + report.stopped);
  if (const std::string text = robot::doubtful_condition(worst, "the motion"); !text.empty()) context.warn(text);
  Load& largest = result.state.largest_load;
  largest.force_n = std::max(largest.force_n, report.largest_load.force_n);
  largest.torque_nm = std::max(largest.torque_nm, report.largest_load.torque_nm);
  result.metrics = figures_of(report, largest);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("robot.move", move)
      .summary("A robot moves the fragment that it holds; it stops before too large a force and at its limits")
      .random()
      .in("phantom", "the broken bone; the fragment that is held is where the state says")
      .in("state", "the robot before the motion")
      .in("motion", "motion in the axes of the robot's base: new place of a point from its old place")
      .in("report", "what the robot said before")
      .out("state", &Result::state, "the robot after the motion")
      .out("report", &Result::report, "the motion by its encoders, the load, and why it stopped early, if it did")
      .out("metrics", &Result::metrics, "load at the end; largest load since the robot gripped the fragment")
      .figures({"force_n", "torque_nm", "largest_force_n", "largest_torque_nm", "warned", "stopped"});
}
