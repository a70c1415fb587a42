// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of all optimizers: it checks the problem, counts evaluations, keeps the best point and stays within
// the budget.
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/base/error.hpp>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "marrow/base/number_text.hpp"

namespace marrow::optimizer {

/// Throws Error unless there are coordinates, start and steps are finite, steps are positive and as many as
/// coordinates, bounds are empty or complete, the start lies within them, step_tolerance is positive and finite, and
/// max_evaluations is at least 1.
inline void check_problem(const MinimisationProblem& problem) {
  const auto n = problem.start.size();
  if (n == 0) throw Error("the optimizer got a start without coordinates; it needs one at least");
  if (problem.initial_step.size() != n || !(problem.initial_step.array() > 0).all() ||
      !problem.initial_step.allFinite() || !problem.start.allFinite())
    throw Error("the optimizer needs a finite start and one positive initial step per coordinate");
  for (const auto* bound : {&problem.lower, &problem.upper}) {
    if (bound->size() && bound->size() != n)
      throw Error(formatted("the optimizer got bounds for {} of {} coordinates", bound->size(), n));
    if (bound->array().isNaN().any()) throw Error("the optimizer got a bound that is not a number");
  }
  if ((problem.lower.size() && (problem.lower.array() > problem.start.array()).any()) ||
      (problem.upper.size() && (problem.upper.array() < problem.start.array()).any()))
    throw Error("the optimizer's start lies outside the bounds");
  if (problem.max_evaluations < 1)
    throw Error(
        formatted("the optimizer needs at least one evaluation, got max_evaluations = {}", problem.max_evaluations));
  if (!(problem.step_tolerance > 0) || !std::isfinite(problem.step_tolerance))
    throw Error(formatted("the optimizer needs a positive, finite step_tolerance, got {:g}", problem.step_tolerance));
}

/// Evaluates a problem in scaled coordinates y = (x - start) / initial_step. Refers to the problem, which must outlive
/// it. For use in one thread.
class Evaluations {
 public:
  struct Spent {};  ///< thrown when the budget of evaluations is spent

  /// Throws Error as check_problem() does.
  explicit Evaluations(const MinimisationProblem& problem) : problem_(problem) {
    check_problem(problem);
    result_.x = problem.start;
    result_.value = std::numeric_limits<double>::infinity();
  }

  Eigen::Index size() const { return problem_.start.size(); }
  double tolerance() const { return problem_.step_tolerance; }
  int left() const { return problem_.max_evaluations - result_.evaluations; }

  /// The nearest point within the bounds.
  Eigen::VectorXd within(const Eigen::VectorXd& y) const { return in_steps(point(y)); }
  /// Turns coordinates x of the problem into scaled coordinates y.
  Eigen::VectorXd in_steps(const Eigen::VectorXd& x) const {
    return (x - problem_.start).cwiseQuotient(problem_.initial_step);
  }

  /// The value at y, moved into the bounds. Instead of a value that is not finite, returns one that is worse than all
  /// finite values so far. Throws Spent.
  double operator()(const Eigen::VectorXd& y) {
    const Eigen::VectorXd x = next(y);
    return noted(x, problem_.function(x));
  }

  bool has_derivatives() const { return bool(problem_.expansion); }
  /// The quadratic expansion of the function about y, moved into the bounds, in scaled coordinates. std::nullopt if it
  /// is not finite. Counts as one evaluation. Throws Spent.
  std::optional<MinimisationProblem::Expansion> expansion(const Eigen::VectorXd& y) {
    const Eigen::VectorXd x = next(y);
    MinimisationProblem::Expansion about = problem_.expansion(x);
    noted(x, about.value);
    if (!std::isfinite(about.value) || !about.gradient.allFinite() || !about.curvature.allFinite()) return std::nullopt;
    const Eigen::VectorXd& scale = problem_.initial_step;
    about.gradient = about.gradient.cwiseProduct(scale).eval();
    about.curvature = (scale.asDiagonal() * about.curvature * scale.asDiagonal()).eval();
    return about;
  }

  /// Calls algorithm(*this), which returns the reason why it stopped, and returns the best point found. Catches Spent.
  /// Throws Error if no value was finite: there is no best point then.
  template <class Algorithm>
  MinimisationResult run(const Algorithm& algorithm) {
    try {
      result_.stopped_because = algorithm(*this);
    } catch (const Spent&) {
      result_.stopped_because = "the budget of evaluations is spent";
    }
    if (!std::isfinite(result_.value))
      throw Error(formatted(
          "the optimizer found no least value: the function is not finite at any of the {} points that were tried",
          result_.evaluations));
    return result_;
  }

 private:
  Eigen::VectorXd next(const Eigen::VectorXd& y) const {
    if (left() < 1) throw Spent();
    return point(y);
  }
  double noted(const Eigen::VectorXd& x, double value) {
    ++result_.evaluations;
    if (problem_.observer) problem_.observer(result_.evaluations, x, value);
    // The returned number is finite, because models fitted by some algorithms would turn infinity into NaN.
    if (!std::isfinite(value)) return worst_ + std::abs(worst_) + 1;
    worst_ = std::max(worst_, value);
    if (value < result_.value) {
      result_.value = value;
      result_.x = x;
    }
    return value;
  }
  Eigen::VectorXd point(const Eigen::VectorXd& y) const {
    Eigen::VectorXd x = problem_.start + problem_.initial_step.cwiseProduct(y);
    if (problem_.lower.size()) x = x.cwiseMax(problem_.lower);
    if (problem_.upper.size()) x = x.cwiseMin(problem_.upper);
    return x;
  }

  const MinimisationProblem& problem_;
  MinimisationResult result_;
  double worst_ = 0;
};

/// An optimizer that calls minimise(problem), which may run in several threads at once.
template <class Minimise>
std::shared_ptr<const Optimizer> optimizer_of(Minimise minimise) {
  class Made : public Optimizer {
   public:
    explicit Made(Minimise minimise) : minimise_(std::move(minimise)) {}
    MinimisationResult minimise(const MinimisationProblem& problem) const override { return minimise_(problem); }

   private:
    const Minimise minimise_;
  };
  return std::make_shared<Made>(std::move(minimise));
}

/// An optimizer that calls algorithm(evaluations), as Evaluations::run() takes it.
template <class Algorithm>
std::shared_ptr<const Optimizer> optimizer_by(Algorithm algorithm) {
  return optimizer_of([algorithm](const MinimisationProblem& problem) { return Evaluations(problem).run(algorithm); });
}

}  // namespace marrow::optimizer
