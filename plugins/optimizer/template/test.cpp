// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/functions.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, FindsTheMinimumOfABowl) {
  marrow::MinimisationProblem problem;
  problem.function = [](const Eigen::VectorXd& x) { return (x[0] - 1) * (x[0] - 1) + 2 * (x[1] + 2) * (x[1] + 2) + 3; };
  problem.start = Eigen::Vector2d(0, 0);
  problem.initial_step = Eigen::Vector2d(0.5, 0.5);
  const auto made = node_test::call("optimizer.new_node", {});
  const marrow::MinimisationResult result = made.at("optimizer").as<marrow::Optimizer>().minimise(problem);
  EXPECT_NEAR(result.x[0], 1, 1e-3);
  EXPECT_NEAR(result.x[1], -2, 1e-3);
  EXPECT_NEAR(result.value, 3, 1e-5);
  EXPECT_LE(result.evaluations, problem.max_evaluations);
}
