// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "optimizer_behaviour.hpp"

namespace direct_test {

std::shared_ptr<const marrow::Optimizer> direct() { return optimizer_behaviour::made_by("optimizer.direct"); }

TEST(Direct, LeavesLocalMinima) {
  auto problem = optimizer_behaviour::valley();
  // Rastrigin's function about (1.3, -0.7): a minimum about every whole number.
  problem.function = [](const Eigen::VectorXd& x) {
    double sum = 0;
    for (const double d : {x[0] - 1.3, x[1] + 0.7}) sum += d * d + 10 * (1 - std::cos(2 * marrow::kPi * d));
    return sum;
  };
  problem.start = Eigen::Vector2d(-2, 3);
  const auto result = direct()->minimise(problem);
  EXPECT_NEAR(result.x[0], 1.3, 0.01);
  EXPECT_NEAR(result.x[1], -0.7, 0.01);
}
TEST(Direct, TakesNanForTheWorst) {
  auto problem = optimizer_behaviour::valley();
  problem.function = [](const Eigen::VectorXd& x) {
    return x[0] > 2 ? std::nan("") : (x - Eigen::Vector2d(1.2, -1)).squaredNorm();
  };
  const auto result = direct()->minimise(problem);
  EXPECT_NEAR(result.x[0], 1.2, 0.02) << "boxes whose middle is not a number are divided last";
  EXPECT_NEAR(result.x[1], -1, 0.02);
}

/// Evaluations and distance from the lowest point of a bowl in six dimensions.
std::pair<int, double> bowl(double tolerance) {
  marrow::MinimisationProblem problem;
  const Eigen::VectorXd lowest = Eigen::VectorXd::LinSpaced(6, -1.3, 2.1);
  problem.function = [&](const Eigen::VectorXd& x) { return (x - lowest).squaredNorm(); };
  problem.start = Eigen::VectorXd::Zero(6);
  problem.initial_step = Eigen::VectorXd::Ones(6);
  problem.max_evaluations = 50000;
  problem.step_tolerance = tolerance;
  const auto result = direct()->minimise(problem);
  EXPECT_EQ(result.stopped_because, "steps are below the tolerance");
  return {result.evaluations, (result.x - lowest).norm()};
}
TEST(Direct, EndsWhenItsBoxIsSmall) {
  // The box about the best point has a volume of tolerance^6, and its sides differ by a factor of 3 at most. So none is
  // longer than 3 times the tolerance, and a corner is at most half of sqrt(6) of that away from the middle.
  int before = 0;
  for (const double tolerance : {0.3, 0.03, 0.003}) {
    const auto [evaluations, off] = bowl(tolerance);
    EXPECT_LT(off, 0.5 * std::sqrt(6.0) * 3 * tolerance);
    EXPECT_GT(evaluations, before);
    EXPECT_LT(evaluations, 3000);
    before = evaluations;
  }
}
TEST(Direct, TakesItsOwnRangeWhereABoundIsInfinite) {
  auto problem = optimizer_behaviour::valley();
  const double infinite = std::numeric_limits<double>::infinity();
  problem.lower = Eigen::Vector2d(-infinite, 0);
  problem.upper = Eigen::Vector2d(infinite, infinite);
  problem.function = [](const Eigen::VectorXd& x) { return (x - Eigen::Vector2d(2, -1)).squaredNorm(); };
  const auto result = direct()->minimise(problem);
  EXPECT_NEAR(result.x[0], 2, 1e-3);
  EXPECT_NEAR(result.x[1], 0, 1e-3);
}

}  // namespace direct_test
