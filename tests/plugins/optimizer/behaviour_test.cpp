// SPDX-License-Identifier: Apache-2.0
// What every optimizer must do.
#include "optimizer_behaviour.hpp"

namespace marrow::test::behaviour_test {

using optimizer_behaviour::refusal_of, optimizer_behaviour::valley;

class EveryOptimizer : public testing::TestWithParam<const char*> {
 protected:
  const Optimizer& optimizer() const { return *optimizer_; }

 private:
  const std::shared_ptr<const Optimizer> optimizer_ =
      optimizer_behaviour::made_by(std::string("optimizer.") + GetParam());
};
/// Those that search near their start.
class LocalOptimizer : public EveryOptimizer {};
/// Those that also find the bottom of a bent valley.
class FineOptimizer : public EveryOptimizer {};

const auto kName = [](const auto& node) { return node.param; };
INSTANTIATE_TEST_SUITE_P(, EveryOptimizer,
                         testing::Values("bobyqa", "cma_es", "direct", "grid", "lbfgs", "levenberg_marquardt",
                                         "nelder_mead", "powell", "sbplx"),
                         kName);
INSTANTIATE_TEST_SUITE_P(, LocalOptimizer,
                         testing::Values("bobyqa", "cma_es", "grid", "lbfgs", "levenberg_marquardt", "nelder_mead",
                                         "powell", "sbplx"),
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

TEST_P(LocalOptimizer, TakesNanForTheWorst) {
  auto problem = valley();
  problem.function = [](const Eigen::VectorXd& x) {
    return x[0] > 2 ? std::numeric_limits<double>::quiet_NaN() : (x - Vector2d(1.9, -1)).squaredNorm();
  };
  const auto result = optimizer().minimise(problem);
  EXPECT_NEAR(result.x[0], 1.9, 0.01);
  EXPECT_NEAR(result.x[1], -1, 0.01);
}

TEST_P(EveryOptimizer, LetsExceptionsPass) {
  auto problem = valley();
  int calls = 0;
  problem.function = [&](const Eigen::VectorXd& x) {
    if (++calls == 5) throw Cancelled();
    return x.squaredNorm();
  };
  EXPECT_THROW(optimizer().minimise(problem), Cancelled);
  EXPECT_EQ(calls, 5);
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

}  // namespace marrow::test::behaviour_test
