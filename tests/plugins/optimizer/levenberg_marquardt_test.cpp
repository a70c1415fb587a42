// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "optimizer_behaviour.hpp"

namespace levenberg_marquardt_test {

std::shared_ptr<const marrow::Optimizer> levenberg_marquardt() {
  return optimizer_behaviour::made_by("optimizer.levenberg_marquardt");
}

// The valley is the sum of the squares of r = (10 (y - x^2), 1 - x).
marrow::MinimisationProblem valley_of_squares() {
  auto problem = optimizer_behaviour::valley();
  problem.expansion = [](const Eigen::VectorXd& x) {
    const Eigen::Vector2d r(10 * (x[1] - x[0] * x[0]), 1 - x[0]);
    Eigen::Matrix2d jacobian;
    jacobian << -20 * x[0], 10, -1, 0;
    return marrow::MinimisationProblem::Expansion{3 + r.squaredNorm(), 2 * jacobian.transpose() * r,
                                                  2 * jacobian.transpose() * jacobian};
  };
  return problem;
}

TEST(LevenbergMarquardt, UsesDerivatives) {
  const auto result = levenberg_marquardt()->minimise(valley_of_squares());
  EXPECT_NEAR(result.x[0], 1, 1e-6);
  EXPECT_NEAR(result.x[1], 1, 1e-6);
  EXPECT_NEAR(result.value, 3, 1e-12);
  EXPECT_LT(result.evaluations, 100);  // 400 and more without
}

// Where derivatives are not numbers, differences of the values do.
TEST(LevenbergMarquardt, SurvivesDerivativesThatAreNoNumbers) {
  auto problem = valley_of_squares();
  const auto right = problem.expansion;
  problem.expansion = [=](const Eigen::VectorXd& x) {
    auto about = right(x);
    about.curvature(0, 0) = std::nan("");
    return about;
  };
  EXPECT_NEAR(levenberg_marquardt()->minimise(problem).value, 3, 1e-4);
}

}  // namespace levenberg_marquardt_test
