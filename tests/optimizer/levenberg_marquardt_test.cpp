// SPDX-License-Identifier: Apache-2.0
#include "plugins/optimizer/levenberg_marquardt.cpp"

#include "optimizer_behaviour.hpp"

TEST(LevenbergMarquardt, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*levenberg_marquardt()); }
TEST(LevenbergMarquardt, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*levenberg_marquardt()); }
TEST(LevenbergMarquardt, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*levenberg_marquardt()); }
TEST(LevenbergMarquardt, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*levenberg_marquardt()); }
TEST(LevenbergMarquardt, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*levenberg_marquardt()); }

// r = (10 (y - x^2), 1 - x): what the valley is made of.
TEST(LevenbergMarquardt, UsesResiduals) {
  auto problem = optimizer_behaviour::valley();
  problem.residuals = [](const Eigen::VectorXd& x) { return std::vector<double>{10 * (x[1] - x[0] * x[0]), 1 - x[0]}; };
  problem.function = [&](const Eigen::VectorXd& x) {
    const auto r = problem.residuals(x);
    return r[0] * r[0] + r[1] * r[1];
  };
  const auto result = levenberg_marquardt()->minimise(problem);
  EXPECT_NEAR(result.x[0], 1, 1e-6);
  EXPECT_NEAR(result.x[1], 1, 1e-6);
  EXPECT_LT(result.evaluations, 200);
}

// Where residuals are not numbers, values are used instead.
TEST(LevenbergMarquardt, SurvivesResidualsThatAreNoNumbers) {
  auto problem = optimizer_behaviour::valley();
  problem.residuals = [](const Eigen::VectorXd&) { return std::vector<double>{std::nan("")}; };
  problem.function = [](const Eigen::VectorXd& x) { return x.squaredNorm(); };
  EXPECT_NEAR(levenberg_marquardt()->minimise(problem).x.norm(), 0, 1e-4);
}
