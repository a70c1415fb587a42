// SPDX-License-Identifier: Apache-2.0
// What every optimizer must do beyond the checks of the kind's suite, and what single ones do besides.
#include "tests/harness/node_test.hpp"

namespace marrow::test::optimizer_test {

/// The minimiser that a node gives with its defaults.
std::shared_ptr<const Optimizer> made_by(const std::string& node) {
  return std::static_pointer_cast<const Optimizer>(call(node, {}).at("optimizer").data);
}

MinimisationProblem valley() {
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
std::string refusal_of(const Optimizer& optimizer, const MinimisationProblem& problem) {
  return message_of([&] { optimizer.minimise(problem); });
}

class EveryOptimizer : public testing::TestWithParam<const char*> {
 protected:
  const Optimizer& optimizer() const { return *optimizer_; }

 private:
  const std::shared_ptr<const Optimizer> optimizer_ = made_by(std::string("optimizer.") + GetParam());
};
/// Those that also find the bottom of a bent valley.
class FineOptimizer : public EveryOptimizer {};

const auto kName = [](const auto& node) { return node.param; };
INSTANTIATE_TEST_SUITE_P(, EveryOptimizer,
                         testing::Values("bobyqa", "cma_es", "direct", "grid", "lbfgs", "levenberg_marquardt",
                                         "nelder_mead", "powell", "sbplx"),
                         kName);
INSTANTIATE_TEST_SUITE_P(, FineOptimizer,
                         testing::Values("bobyqa", "cma_es", "lbfgs", "levenberg_marquardt", "nelder_mead", "powell",
                                         "sbplx"),
                         kName);

TEST_P(FineOptimizer, FindsTheMinimum) {
  const auto result = optimizer().minimise(valley());
  EXPECT_NEAR(result.x[0], 1, 1e-3);
  EXPECT_NEAR(result.x[1], 1, 1e-3);
  EXPECT_NEAR(result.value, 3, 1e-6);
  EXPECT_FALSE(result.stopped_because.empty());
}

TEST_P(FineOptimizer, KeepsToBoundsAndBudget) {
  auto problem = valley();
  problem.lower = Vector2d(-2, -2);
  problem.upper = Vector2d(0.5, 2);
  int calls = 0;
  problem.observer = [&](int evaluation, const Eigen::VectorXd& x, double) {
    EXPECT_EQ(evaluation, ++calls);
    EXPECT_LE(x[0], 0.5 + 1e-12);
    EXPECT_GE(x[0], -2 - 1e-12);
  };
  const auto result = optimizer().minimise(problem);
  EXPECT_NEAR(result.x[0], 0.5, 1e-3);
  EXPECT_NEAR(result.x[1], 0.25, 1e-3);
  EXPECT_EQ(result.evaluations, calls);

  problem = valley();
  problem.max_evaluations = 17;
  const auto short_run = optimizer().minimise(problem);
  EXPECT_LE(short_run.evaluations, 17);
  EXPECT_EQ(short_run.stopped_because, "the budget of evaluations is spent");
}

TEST_P(EveryOptimizer, RefusesNonsense) {
  const auto message = [&](const MinimisationProblem& problem) { return refusal_of(optimizer(), problem); };
  auto problem = valley();
  problem.initial_step[1] = 0;
  EXPECT_EQ(message(problem), "the optimizer needs a finite start and one positive initial step per coordinate");
  problem = valley();
  problem.lower = Eigen::VectorXd::Zero(3);
  EXPECT_EQ(message(problem), "the optimizer got bounds for 3 of 2 coordinates");
  problem = valley();
  problem.lower = Vector2d(0, 0);
  EXPECT_EQ(message(problem), "the optimizer's start lies outside the bounds");
  problem = valley();
  problem.max_evaluations = 0;
  EXPECT_EQ(message(problem), "the optimizer needs at least one evaluation, got max_evaluations = 0");
  problem = valley();
  problem.start = problem.initial_step = Eigen::VectorXd();
  EXPECT_EQ(message(problem), "the optimizer got a start without coordinates; it needs one at least");
  problem = valley();
  problem.upper = Vector2d(9, std::nan(""));
  EXPECT_EQ(message(problem), "the optimizer got a bound that is not a number");
  const std::pair<double, std::string> tolerances[] = {
      {std::nan(""), "nan"}, {0, "0"}, {-0.5, "-0.5"}, {std::numeric_limits<double>::infinity(), "inf"}};
  for (const auto& [tolerance, text] : tolerances) {
    problem = valley();
    problem.step_tolerance = tolerance;
    EXPECT_EQ(message(problem), "the optimizer needs a positive, finite step_tolerance, got " + text);
  }
}

// A function that is nowhere a number has no best point. Each optimizer decides how many points it tries.
TEST_P(EveryOptimizer, RefusesWhatIsNowhereFinite) {
  auto problem = valley();
  int calls = 0;
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    calls = 0;
    problem.function = [&](const Eigen::VectorXd&) { return ++calls, value; };
    const std::string said = refusal_of(optimizer(), problem);
    EXPECT_EQ(said, "the optimizer found no least value: the function is not finite at any of the " +
                        std::to_string(calls) + " points that were tried");
  }
}

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

}  // namespace marrow::test::optimizer_test
