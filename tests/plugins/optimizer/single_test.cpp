// SPDX-License-Identifier: Apache-2.0
// What single optimizers do besides what every one must do.
#include "optimizer_behaviour.hpp"

namespace marrow::test::single_test {

using optimizer_behaviour::made_by, optimizer_behaviour::refusal_of, optimizer_behaviour::valley;

TEST(Bobyqa, RefusesOneDimension) {
  MinimisationProblem problem;
  problem.function = [](const Eigen::VectorXd& x) { return x.squaredNorm(); };
  problem.start = problem.initial_step = Eigen::VectorXd::Ones(1);
  EXPECT_EQ(refusal_of(*made_by("optimizer.bobyqa"), problem),
            "BOBYQA minimises functions of two or more numbers, got 1; use another optimizer");
}

TEST(Bobyqa, SaysWhichBoundsAreTooNear) {
  auto problem = valley();
  problem.lower = Vector2d(-2, 0.75);
  problem.upper = Vector2d(2, 1.25);
  EXPECT_EQ(refusal_of(*made_by("optimizer.bobyqa"), problem),
            "BOBYQA needs bounds that are two initial steps apart: those of coordinate 2 are 0.5 apart, and its step "
            "is 0.5; use smaller steps or another optimizer");
  problem.initial_step = Vector2d(0.5, 0.2);
  const auto result = made_by("optimizer.bobyqa")->minimise(problem);
  // By hand: along the valley y = x^2 from the start, where x is negative, the least is nearest to (1, 1) at y = 0.75.
  EXPECT_LE(result.value, problem.function(Vector2d(-std::sqrt(0.75), 0.75)) + 1e-3);
}

TEST(Direct, LeavesLocalMinima) {
  auto problem = valley();
  // Rastrigin's function about (1.3, -0.7): a minimum about every whole number.
  problem.function = [](const Eigen::VectorXd& x) {
    double sum = 0;
    for (const double d : {x[0] - 1.3, x[1] + 0.7}) sum += d * d + 10 * (1 - std::cos(2 * kPi * d));
    return sum;
  };
  problem.start = Vector2d(-2, 3);
  const auto result = made_by("optimizer.direct")->minimise(problem);
  EXPECT_NEAR(result.x[0], 1.3, 0.01);
  EXPECT_NEAR(result.x[1], -0.7, 0.01);
}
TEST(Direct, TakesNanForTheWorst) {
  auto problem = valley();
  problem.function = [](const Eigen::VectorXd& x) {
    return x[0] > 2 ? std::nan("") : (x - Vector2d(1.2, -1)).squaredNorm();
  };
  const auto result = made_by("optimizer.direct")->minimise(problem);
  EXPECT_NEAR(result.x[0], 1.2, 0.02) << "boxes whose middle is not a number are divided last";
  EXPECT_NEAR(result.x[1], -1, 0.02);
}

/// Evaluations and distance from the lowest point of a bowl in six dimensions.
std::pair<int, double> bowl(double tolerance) {
  MinimisationProblem problem;
  const Eigen::VectorXd lowest = Eigen::VectorXd::LinSpaced(6, -1.3, 2.1);
  problem.function = [&](const Eigen::VectorXd& x) { return (x - lowest).squaredNorm(); };
  problem.start = Eigen::VectorXd::Zero(6);
  problem.initial_step = Eigen::VectorXd::Ones(6);
  problem.max_evaluations = 50000;
  problem.step_tolerance = tolerance;
  const auto result = made_by("optimizer.direct")->minimise(problem);
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
  auto problem = valley();
  const double infinite = std::numeric_limits<double>::infinity();
  problem.lower = Vector2d(-infinite, 0);
  problem.upper = Vector2d(infinite, infinite);
  problem.function = [](const Eigen::VectorXd& x) { return (x - Vector2d(2, -1)).squaredNorm(); };
  const auto result = made_by("optimizer.direct")->minimise(problem);
  EXPECT_NEAR(result.x[0], 2, 1e-3);
  EXPECT_NEAR(result.x[1], 0, 1e-3);
}

TEST(Grid, FollowsTheBestAndBecomesFiner) {
  auto problem = valley();
  problem.function = [](const Eigen::VectorXd& x) { return (x - Vector2d(3.21, -0.4)).squaredNorm(); };
  problem.step_tolerance = 1e-4;
  const auto result = made_by("optimizer.grid")->minimise(problem);
  EXPECT_NEAR(result.x[0], 3.21, 1e-3);
  EXPECT_NEAR(result.x[1], -0.4, 1e-3);
  EXPECT_EQ(result.stopped_because, "steps are below the tolerance");
}

TEST(Grid, RefusesAnEvenNumberOfPoints) {
  EXPECT_EQ(refusal("optimizer.grid", {}, {{"grid_points", std::int64_t{4}}}),
            "grid_points: expected an odd number, so that the middle is one of them, got 4");
}

TEST(Lbfgs, UsesDerivatives) {
  auto problem = valley();
  problem.expansion = [&](const Eigen::VectorXd& x) {
    const double bend = x[1] - x[0] * x[0];
    return MinimisationProblem::Expansion{
        problem.function(x), Vector2d(-2 * (1 - x[0]) - 400 * x[0] * bend, 200 * bend), Eigen::Matrix2d::Identity()};
  };
  const auto result = made_by("optimizer.lbfgs")->minimise(problem);
  EXPECT_NEAR((result.x - Vector2d(1, 1)).norm(), 0, 1e-5);
  EXPECT_LT(result.evaluations, 150);
}

// The valley is the sum of the squares of r = (10 (y - x^2), 1 - x).
MinimisationProblem valley_of_squares() {
  auto problem = valley();
  problem.expansion = [](const Eigen::VectorXd& x) {
    const Vector2d r(10 * (x[1] - x[0] * x[0]), 1 - x[0]);
    Eigen::Matrix2d jacobian;
    jacobian << -20 * x[0], 10, -1, 0;
    return MinimisationProblem::Expansion{3 + r.squaredNorm(), 2 * jacobian.transpose() * r,
                                          2 * jacobian.transpose() * jacobian};
  };
  return problem;
}

TEST(LevenbergMarquardt, UsesDerivatives) {
  const auto result = made_by("optimizer.levenberg_marquardt")->minimise(valley_of_squares());
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
  EXPECT_NEAR(made_by("optimizer.levenberg_marquardt")->minimise(problem).value, 3, 1e-4);
}

}  // namespace marrow::test::single_test
