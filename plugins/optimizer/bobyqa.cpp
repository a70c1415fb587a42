// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/optimizer/nlopt_run.hpp"

namespace {

/// The first models need points one step away to either side, so bounds may not be nearer to each other than two steps.
void check_bounds(const marrow::MinimisationProblem& problem) {
  if (problem.lower.size() == 0 || problem.upper.size() == 0) return;
  for (Eigen::Index i = 0; i < problem.start.size(); ++i) {
    const double range = problem.upper[i] - problem.lower[i], step = problem.initial_step[i];
    if (range > 0 && range < 2 * step)
      throw marrow::Error(
          marrow::formatted("BOBYQA needs bounds that are two initial steps apart: those of coordinate {} are {:g} "
                            "apart, and its step is {:g}; use smaller steps or another optimizer",
                            i + 1, range, step));
  }
}

marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) {
  marrow::optimizer::check_problem(problem);
  if (problem.start.size() < 2)
    throw marrow::Error(marrow::formatted(
        "BOBYQA minimises functions of two or more numbers, got {}; use another optimizer", problem.start.size()));
  check_bounds(problem);
  return marrow::optimizer::NloptRun(nlopt::LN_BOBYQA, problem).run();
}

std::shared_ptr<const marrow::Optimizer> bobyqa() { return marrow::optimizer::optimizer_of(minimise); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.bobyqa", bobyqa)
      .summary("Quadratic models in a trust region, without derivatives (BOBYQA: Powell 2009; by NLopt)")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives");
}
