// SPDX-License-Identifier: Apache-2.0
// Registrations for the tests of `marrow conformance`: a plain right one, and others that are wrong in one way each.
#include <marrow/plugin.hpp>

namespace {

using namespace marrow;

struct Result {
  Pose pose;
  List<Pose> stages;
};

/// Minimises the cost at one level over all six axes, with these first steps.
RigidTransform searched(const Cost& cost, const Optimizer& optimizer, const Pose& from, double reach_px,
                        double step_deg_and_mm) {
  const auto level = cost.at_level({4, reach_px, 0});
  MinimisationProblem problem;
  problem.function = [&](const Eigen::VectorXd& x) {
    return level->value(moved(from.world_from_model, from.frame, Vector6d(x)));
  };
  problem.start = Eigen::VectorXd::Zero(6);
  problem.initial_step = Eigen::VectorXd::Constant(6, step_deg_and_mm);
  problem.initial_step.head<3>() *= radians(1);
  problem.step_tolerance = 0.01;
  return moved(from.world_from_model, from.frame, Vector6d(optimizer.minimise(problem).x));
}

Result result_of(const Pose& start, const Pose& pose, const Cost& cost) {
  Result result{pose, {}};
  result.pose.covariance.reset();
  result.pose.cost = cost.value(pose.world_from_model);
  result.stages.add("start", start);
  result.stages.add("final", result.pose);
  return result;
}

void check(const Pose& start, const Cost& cost) {
  check_pose(start, "start");
  const double value = cost.value(start.world_from_model);
  RigidTransform aside = start.world_from_model;
  aside.translation_mm.x() += 20;
  if (!std::isfinite(value) || value == cost.value(aside) || !cost.nothing_compared(start.world_from_model).empty())
    throw Error("the images say nothing about this pose; give a start nearer to the bone");
}

Result plain(const Cost& cost, const Optimizer& optimizer, const Pose& start) {
  check(start, cost);
  Pose pose = start;
  for (const double reach_px : {24.0, 12.0, 6.0})
    pose.world_from_model = searched(cost, optimizer, pose, reach_px, reach_px / 8);
  pose.warnings = cost.silent_views(pose.world_from_model);
  return result_of(start, pose, cost);
}

/// Gives the start back.
Result idle(const Cost& cost, const Optimizer&, const Pose& start) {
  check(start, cost);
  return result_of(start, start, cost);
}

/// Right from near starts, but it has no coarse level: it is caught by other minima on its way from far ones.
Result near_sighted(const Cost& cost, const Optimizer& optimizer, const Pose& start) {
  check(start, cost);
  Pose pose = start;
  pose.world_from_model = searched(cost, optimizer, pose, 2, 0.5);
  return result_of(start, pose, cost);
}

template <class Function>
void add(Plugin& plugin, const char* name, Function* function) {
  plugin.node(name, function)
      .summary("for a test")
      .in("cost", "cost of a pose")
      .in("optimizer", "minimiser")
      .in("start", "pose to start from")
      .out("pose", &Result::pose, "pose of least cost")
      .out("stages", &Result::stages, "poses of the search", over("stage"));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  add(plugin, "register.plain", plain);
  add(plugin, "register.idle", idle);
  add(plugin, "register.near_sighted", near_sighted);
}
