// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <exception>
#include <nlopt.hpp>
#include <vector>

#include "evaluations.hpp"

/// Runs one of NLopt's algorithms without derivatives on a problem. The algorithm works in units of the initial step,
/// so that coordinates of different scale are alike to it.
class NloptRun {
 public:
  NloptRun(nlopt::algorithm algorithm, const marrow::MinimisationProblem& problem)
      : problem_(problem), optimizer_(algorithm, unsigned(problem.start.size())) {
    check_problem(problem);
    const std::vector<double> ones(std::size_t(problem.start.size()), 1.0);
    optimizer_.set_min_objective(&NloptRun::evaluate, this);
    optimizer_.set_initial_step(ones);
    optimizer_.set_xtol_abs(problem.step_tolerance);
    optimizer_.set_maxeval(problem.max_evaluations);
    if (problem.lower.size()) optimizer_.set_lower_bounds(scaled(problem.lower));
    if (problem.upper.size()) optimizer_.set_upper_bounds(scaled(problem.upper));
  }

  marrow::MinimisationResult run() {
    std::vector<double> y(std::size_t(problem_.start.size()), 0.0);
    double value = 0;
    result_.x = problem_.start;
    result_.value = std::numeric_limits<double>::infinity();
    try {
      result_.stopped_because = words(optimizer_.optimize(y, value));
    } catch (const nlopt::roundoff_limited&) {
      result_.stopped_because = "rounding errors hide any further progress";
    } catch (const nlopt::forced_stop&) {
      if (is_spent_) result_.stopped_because = words(nlopt::MAXEVAL_REACHED);
      else if (!thrown_) throw;
    }
    // NLopt replaces what the function throws by its own exceptions, so the original is kept here.
    if (thrown_) std::rethrow_exception(thrown_);
    return result_;
  }

 private:
  std::vector<double> scaled(const Eigen::VectorXd& bound) const {
    const Eigen::VectorXd y = (bound - problem_.start).cwiseQuotient(problem_.initial_step);
    return {y.begin(), y.end()};
  }

  static double evaluate(const std::vector<double>& y, std::vector<double>&, void* self) {
    return static_cast<NloptRun*>(self)->evaluate(y);
  }

  double evaluate(const std::vector<double>& y) {
    if (result_.evaluations >= problem_.max_evaluations) {  // not all of NLopt's algorithms keep to it
      is_spent_ = true;
      optimizer_.force_stop();
      return worst_;
    }
    try {
      const Eigen::VectorXd x =
          problem_.start + problem_.initial_step.cwiseProduct(Eigen::VectorXd::Map(y.data(), Eigen::Index(y.size())));
      const double value = problem_.function(x);
      ++result_.evaluations;
      if (problem_.observer) problem_.observer(result_.evaluations, x, value);
      // A finite number, because the models that some algorithms fit would turn infinity into NaN.
      if (!std::isfinite(value)) return worst_ + std::abs(worst_) + 1;
      worst_ = std::max(worst_, value);
      if (value < result_.value) {
        result_.value = value;
        result_.x = x;
      }
      return value;
    } catch (...) {
      thrown_ = std::current_exception();
      optimizer_.force_stop();
      return worst_;
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

  const marrow::MinimisationProblem& problem_;
  nlopt::opt optimizer_;
  marrow::MinimisationResult result_;
  double worst_ = 0;
  bool is_spent_ = false;
  std::exception_ptr thrown_;
};
