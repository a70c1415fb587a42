// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <exception>
#include <nlopt.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "marrow/optimizer/evaluations.hpp"

namespace marrow::optimizer {

/// Runs one of NLopt's derivative-free algorithms on a problem. The algorithm works in units of the initial step, so
/// that all coordinates have the same scale. Throws Error as check_problem() does, and if NLopt refuses the problem.
/// Exceptions of the function pass through.
class NloptRun {
 public:
  NloptRun(nlopt::algorithm algorithm, const MinimisationProblem& problem)
      : evaluate_(problem), optimizer_(algorithm, unsigned(problem.start.size())) {
    optimizer_.set_min_objective(&NloptRun::evaluate, this);
    optimizer_.set_initial_step(std::vector<double>(std::size_t(problem.start.size()), 1.0));
    optimizer_.set_xtol_abs(problem.step_tolerance);
    optimizer_.set_maxeval(problem.max_evaluations);
    if (problem.lower.size()) optimizer_.set_lower_bounds(scaled(problem.lower));
    if (problem.upper.size()) optimizer_.set_upper_bounds(scaled(problem.upper));
  }

  /// For algorithms that end when a box is small, and not a step: the side of this box as a fraction of the range.
  void end_at_part_of_range(double fraction) { optimizer_.set_xtol_rel(fraction); }

  MinimisationResult run() {
    return evaluate_.run([&](Evaluations&) -> std::string {
      std::vector<double> y(std::size_t(evaluate_.size()), 0.0);
      double value = 0;
      try {
        return words(optimizer_.optimize(y, value));
      } catch (const nlopt::roundoff_limited&) {
        return "rounding errors hide any further progress";
      } catch (const nlopt::forced_stop&) {
        // NLopt replaces the function's exceptions by its own, so evaluate() has kept the original one.
        if (thrown_) std::rethrow_exception(thrown_);
        throw;
      } catch (const std::invalid_argument& refused) {
        throw Error(std::string("the optimizer cannot minimise this function within these bounds: NLopt says: ") +
                    refused.what());
      }
    });
  }

 private:
  std::vector<double> scaled(const Eigen::VectorXd& bound) const {
    const Eigen::VectorXd y = evaluate_.in_steps(bound);
    return {y.begin(), y.end()};
  }

  static double evaluate(const std::vector<double>& y, std::vector<double>&, void* self) {
    NloptRun& run = *static_cast<NloptRun*>(self);
    if (run.thrown_) return 0;  // some of NLopt's algorithms ask for a few more values before they stop
    try {
      return run.evaluate_(Eigen::VectorXd::Map(y.data(), Eigen::Index(y.size())));
    } catch (...) {  // thrown by the function; or Spent, because some algorithms exceed their budget
      run.thrown_ = std::current_exception();
      run.optimizer_.force_stop();
      return 0;
    }
  }

  static std::string words(nlopt::result result) {
    switch (result) {
      case nlopt::XTOL_REACHED:
        return "steps are below the tolerance";
      case nlopt::FTOL_REACHED:
        return "the value changes no more";
      case nlopt::MAXEVAL_REACHED:
        return "the budget of evaluations is spent";
      default:
        return "converged";
    }
  }

  Evaluations evaluate_;
  nlopt::opt optimizer_;
  std::exception_ptr thrown_;
};

}  // namespace marrow::optimizer
