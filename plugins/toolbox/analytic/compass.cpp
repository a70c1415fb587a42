// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/compass.hpp"

namespace marrow::analytic {

MinimisationResult Compass::minimise(const MinimisationProblem& problem) const {
  MinimisationResult result{problem.start, problem.function(problem.start), 1, "steps are below the tolerance"};
  for (double size = 1; size > problem.step_tolerance && result.evaluations < problem.max_evaluations;) {
    bool is_better = false;
    for (Eigen::Index i = 0; i < problem.start.size(); ++i)
      for (const double sense : {1.0, -1.0}) {
        Eigen::VectorXd x = result.x;
        x[i] += sense * size * problem.initial_step[i];
        const double value = problem.function(x);
        ++result.evaluations;
        if (problem.observer) problem.observer(result.evaluations, x, value);
        if (!(value < result.value)) continue;
        result.x = x, result.value = value, is_better = true;
      }
    if (!is_better) size *= 0.5;
  }
  return result;
}

}  // namespace marrow::analytic
