// SPDX-License-Identifier: Apache-2.0
#pragma once
// A problem for optimizers, and what they say of it.
#include "tests/harness/node_test.hpp"

namespace marrow::test::optimizer_behaviour {

/// The minimiser that a node gives with its defaults.
inline std::shared_ptr<const Optimizer> made_by(const std::string& node) {
  return std::static_pointer_cast<const Optimizer>(call(node, {}).at("optimizer").data);
}

inline MinimisationProblem valley() {
  MinimisationProblem problem;
  // A bent valley whose lowest point is (1, 1), value 3 (Rosenbrock's function, shifted).
  problem.function = [](const Eigen::VectorXd& x) {
    return 3 + std::pow(1 - x[0], 2) + 100 * std::pow(x[1] - x[0] * x[0], 2);
  };
  problem.start = Vector2d(-1.2, 1);
  problem.initial_step = Vector2d(0.5, 0.5);
  problem.max_evaluations = 2000;
  problem.step_tolerance = 1e-7;
  return problem;
}

/// Why an optimizer refuses a problem; empty if it does not.
inline std::string refusal_of(const Optimizer& optimizer, const MinimisationProblem& problem) {
  return message_of([&] { optimizer.minimise(problem); });
}

}  // namespace marrow::test::optimizer_behaviour
