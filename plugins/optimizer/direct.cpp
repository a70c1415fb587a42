// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/optimizer/nlopt_run.hpp"

namespace {

struct Options {
  double reach = 10;
};

/// The side of a box as long as the step tolerance, as a fraction of the range: NLopt compares volumes, so this is a
/// mean over the coordinates. Below the rounding of numbers, boxes cannot be divided.
double least_side(const marrow::MinimisationProblem& bounded) {
  double sum = 0;
  int free = 0;
  for (Eigen::Index i = 0; i < bounded.start.size(); ++i) {
    const double range = bounded.upper[i] - bounded.lower[i];
    if (range > 0) sum += std::log(bounded.step_tolerance * bounded.initial_step[i] / range), ++free;
  }
  return free > 0 ? std::clamp(std::exp(sum / free), 1e-15, 1.0) : 1.0;
}

std::shared_ptr<const marrow::Optimizer> direct(const Options& options) {
  return marrow::optimizer::optimizer_of([options](const marrow::MinimisationProblem& problem) {
    marrow::optimizer::check_problem(problem);
    marrow::MinimisationProblem bounded = problem;
    const Eigen::VectorXd low = problem.start - options.reach * problem.initial_step;
    const Eigen::VectorXd high = problem.start + options.reach * problem.initial_step;
    bounded.lower = problem.lower.size() ? problem.lower.array().isFinite().select(problem.lower, low).eval() : low;
    bounded.upper = problem.upper.size() ? problem.upper.array().isFinite().select(problem.upper, high).eval() : high;
    // NLopt's other version, GN_DIRECT_L, stops only at its budget.
    marrow::optimizer::NloptRun search(nlopt::GN_ORIG_DIRECT_L, bounded);
    search.end_at_part_of_range(least_side(bounded));
    return search.run();
  });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.direct", direct)
      .summary(
          "Divides the whole range into boxes, and promising boxes into smaller ones (DIRECT-L: Gablonsky and Kelley "
          "2001; by NLopt)")
      .out("optimizer", "global minimiser without derivatives")
      .option("reach", &Options::reach,
              "range to either side of the start where the problem has no bounds, in units of the initial steps",
              marrow::at_least(1e-3), marrow::unit("1"));
}
