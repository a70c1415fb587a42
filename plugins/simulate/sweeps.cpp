// SPDX-License-Identifier: Apache-2.0
// The commands to a robot in a study of accuracy: turns about one axis after another.
#include <marrow/plugin.hpp>

namespace {

using namespace marrow;

struct Options {
  std::vector<std::string> axes{"x", "y", "z"};
  double max_rotation_deg = 15;
  double turn_step_deg = 1;
  Eigen::Vector3d pivot_mm{0, 0, 90};
};

/// The number of digits after the point that tells the steps apart; at least two.
int digits_of(double step_deg) {
  constexpr int kLeast = 2, kMost = 6;
  for (int digits = kLeast; digits < kMost; ++digits) {
    const double units = step_deg * std::pow(10, digits);
    if (std::abs(units - std::round(units)) < 1e-6) return digits;
  }
  return kMost;
}

Pose turned(int axis, double angle_deg, const Eigen::Vector3d& pivot_mm) {
  Pose pose;
  pose.world_from_model = {
      "home", "platform", rotation_from_vector(radians(angle_deg) * Eigen::Vector3d::Unit(axis)), {}};
  pose.world_from_model.translation_mm = pivot_mm - pose.world_from_model.rotation * pivot_mm;
  return pose;
}

List<Pose> sweeps(const Options& options) {
  const int steps = int(std::floor(options.max_rotation_deg / options.turn_step_deg + 1e-9));
  const int digits = digits_of(options.turn_step_deg);
  List<Pose> commands;
  commands.add("neutral", turned(0, 0, options.pivot_mm));
  for (const std::string& axis : options.axes) {
    const auto add = [&](int step) {
      const std::string name = formatted("r{}{:+0{}.{}f}", axis, step * options.turn_step_deg, 4 + digits, digits);
      commands.add(name, turned(axis[0] - 'x', step * options.turn_step_deg, options.pivot_mm));
    };
    // From neutral to one side, then from neutral to the other. So each motion begins near a known one.
    for (int step = 0; step <= steps; ++step) add(step);
    for (int step = 1; step <= steps; ++step) add(-step);
  }
  return commands;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.sweeps", sweeps)
      .summary("Motions that a platform is told to make: turns about x, y and z, each from one side to the other")
      .out("commands",
           "motions from home, with z upwards: first 'neutral', then for example 'rx+03.00' for 3 degrees about x; a "
           "step of 0.015 degrees has three digits after the point",
           over("position"))
      .option("axes", &Options::axes, "axes of the platform at home", one_of({"x", "y", "z"}))
      .relation(at_least_one({"axes"}))
      .relation(distinct("axes"))
      .option("max_rotation_deg", &Options::max_rotation_deg, "largest turn, to either side", at_least(0), at_most(90))
      .option("turn_step_deg", &Options::turn_step_deg, "step between two turns", at_least(0.01), at_most(90))
      .option("pivot_mm", &Options::pivot_mm, "the point that stays, from the middle of the platform");
}
