// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every optimizer must do, as functions that the test of each calls.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <marrow/base/error.hpp>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <string>
#include <utility>

#include "shipped.hpp"

namespace optimizer_behaviour {

/// The minimiser that a node gives with its defaults.
inline std::shared_ptr<const marrow::Optimizer> made_by(const std::string& node) {
  return std::static_pointer_cast<const marrow::Optimizer>(shipped::call(node, {}).at("optimizer").data);
}

inline marrow::MinimisationProblem valley() {
  marrow::MinimisationProblem problem;
  // A bent valley whose lowest point is (1, 1), value 3 (Rosenbrock's function, shifted).
  problem.function = [](const Eigen::VectorXd& x) {
    return 3 + std::pow(1 - x[0], 2) + 100 * std::pow(x[1] - x[0] * x[0], 2);
  };
  problem.start = Eigen::Vector2d(-1.2, 1);
  problem.initial_step = Eigen::Vector2d(0.5, 0.5);
  problem.max_evaluations = 2000;
  problem.step_tolerance = 1e-7;
  return problem;
}

inline void finds_the_minimum(const marrow::Optimizer& optimizer) {
  const auto result = optimizer.minimise(valley());
  EXPECT_NEAR(result.x[0], 1, 1e-3);
  EXPECT_NEAR(result.x[1], 1, 1e-3);
  EXPECT_NEAR(result.value, 3, 1e-6);
  EXPECT_FALSE(result.stopped_because.empty());
}

inline void keeps_to_bounds_and_budget(const marrow::Optimizer& optimizer) {
  auto problem = valley();
  problem.lower = Eigen::Vector2d(-2, -2);
  problem.upper = Eigen::Vector2d(0.5, 2);
  int calls = 0;
  problem.observer = [&](int evaluation, const Eigen::VectorXd& x, double) {
    EXPECT_EQ(evaluation, ++calls);
    EXPECT_LE(x[0], 0.5 + 1e-12);
    EXPECT_GE(x[0], -2 - 1e-12);
  };
  const auto result = optimizer.minimise(problem);
  EXPECT_NEAR(result.x[0], 0.5, 1e-3);
  EXPECT_NEAR(result.x[1], 0.25, 1e-3);
  EXPECT_EQ(result.evaluations, calls);

  problem = valley();
  problem.max_evaluations = 17;
  const auto short_run = optimizer.minimise(problem);
  EXPECT_LE(short_run.evaluations, 17);
  EXPECT_EQ(short_run.stopped_because, "the budget of evaluations is spent");
}

inline void takes_nan_for_the_worst(const marrow::Optimizer& optimizer) {
  auto problem = valley();
  problem.function = [](const Eigen::VectorXd& x) {
    return x[0] > 2 ? std::numeric_limits<double>::quiet_NaN() : (x - Eigen::Vector2d(1.9, -1)).squaredNorm();
  };
  const auto result = optimizer.minimise(problem);
  EXPECT_NEAR(result.x[0], 1.9, 0.01);
  EXPECT_NEAR(result.x[1], -1, 0.01);
}

inline void lets_exceptions_pass(const marrow::Optimizer& optimizer) {
  auto problem = valley();
  int calls = 0;
  problem.function = [&](const Eigen::VectorXd& x) {
    if (++calls == 5) throw marrow::Cancelled();
    return x.squaredNorm();
  };
  EXPECT_THROW(optimizer.minimise(problem), marrow::Cancelled);
  EXPECT_EQ(calls, 5);
}

/// Why an optimizer refuses a problem; empty if it does not.
inline std::string refusal_of(const marrow::Optimizer& optimizer, const marrow::MinimisationProblem& problem) {
  try {
    optimizer.minimise(problem);
  } catch (const marrow::Error& error) {
    return error.what();
  }
  return "";
}

inline void refuses_nonsense(const marrow::Optimizer& optimizer) {
  const auto message = [&](const marrow::MinimisationProblem& problem) { return refusal_of(optimizer, problem); };
  auto problem = valley();
  problem.initial_step[1] = 0;
  EXPECT_EQ(message(problem), "the optimizer needs a finite start and one positive initial step per coordinate");
  problem = valley();
  problem.lower = Eigen::VectorXd::Zero(3);
  EXPECT_EQ(message(problem), "the optimizer got bounds for 3 of 2 coordinates");
  problem = valley();
  problem.lower = Eigen::Vector2d(0, 0);
  EXPECT_EQ(message(problem), "the optimizer's start lies outside the bounds");
  problem = valley();
  problem.max_evaluations = 0;
  EXPECT_EQ(message(problem), "the optimizer needs at least one evaluation, got max_evaluations = 0");
  problem = valley();
  problem.start = problem.initial_step = Eigen::VectorXd();
  EXPECT_EQ(message(problem), "the optimizer got a start without coordinates; it needs one at least");
  problem = valley();
  problem.upper = Eigen::Vector2d(9, std::nan(""));
  EXPECT_EQ(message(problem), "the optimizer got a bound that is not a number");
  const std::pair<double, std::string> tolerances[] = {
      {std::nan(""), "nan"}, {0, "0"}, {-0.5, "-0.5"}, {std::numeric_limits<double>::infinity(), "inf"}};
  for (const auto& [tolerance, text] : tolerances) {
    problem = valley();
    problem.step_tolerance = tolerance;
    EXPECT_EQ(message(problem), "the optimizer needs a positive, finite step_tolerance, got " + text);
  }
}

/// A function that is nowhere a number has no best point. How many points are tried is the optimizer's matter.
inline void refuses_what_is_nowhere_finite(const marrow::Optimizer& optimizer) {
  auto problem = valley();
  int calls = 0;
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    calls = 0;
    problem.function = [&](const Eigen::VectorXd&) { return ++calls, value; };
    const std::string said = refusal_of(optimizer, problem);
    EXPECT_EQ(said, "the optimizer found no least value: the function is not finite at any of the " +
                        std::to_string(calls) + " points that were tried");
  }
}

}  // namespace optimizer_behaviour
