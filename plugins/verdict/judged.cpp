// SPDX-License-Identifier: Apache-2.0
#include "judged.hpp"

#include <cmath>

#include "marrow/toolbox/geometry/targets.hpp"
#include "marrow/toolbox/search/derivatives.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace marrow::verdict {

double Judged::off_mm(const RigidTransform& other) const {
  return geometry::mean(geometry::target_errors_mm(other, pose.world_from_model, targets_mm));
}

double Judged::axial_deg(const RigidTransform& other) const {
  return std::abs(degrees(motion_between(pose.world_from_model, other, frame)[2]));
}

RigidTransform Judged::moved_by(const RigidTransform& from, const Vector6d& deg_and_mm) const {
  Vector6d motion = deg_and_mm;
  motion.head<3>() *= radians(1);
  return moved(from, frame, motion);
}

std::vector<RigidTransform> near_starts(const Judged& judged) {
  constexpr double kMotions[][6] = {{1.5, -1.5, 4, 2, -2, 2}, {-1.5, 1.5, -4, -2, 2, -2}, {2, 2, -6, -1, -1, 3}};
  std::vector<RigidTransform> starts;
  for (const auto& deg_and_mm : kMotions)
    starts.push_back(judged.moved_by(judged.pose.world_from_model, Vector6d::Map(deg_and_mm)));
  return starts;
}

Minimum minimum_near(const Judged& judged, const Cost& cost, const RigidTransform& from, const FirstSteps& steps,
                     int max_evaluations) {
  judged.context->check_cancelled();
  MinimisationProblem problem;
  const auto at = [&](const Eigen::VectorXd& x) { return judged.moved_by(from, Vector6d(x)); };
  problem.function = [&](const Eigen::VectorXd& x) { return cost.value(at(x)); };
  if (cost.expansion(from, judged.frame))
    problem.expansion = [&](const Eigen::VectorXd& x) {
      return search::in_coordinates(cost.expansion(at(x), judged.frame), Vector6d(x), search::kAllAxes);
    };
  problem.start = Eigen::VectorXd::Zero(6);
  problem.initial_step = Eigen::VectorXd::Constant(6, steps.mm);
  problem.initial_step.head<3>() << steps.deg, steps.deg, steps.axial_deg;
  problem.max_evaluations = max_evaluations;
  problem.step_tolerance = steps.tolerance;
  const MinimisationResult result = judged.optimizer->minimise(problem);
  return {at(result.x), result.value};
}

}  // namespace marrow::verdict
