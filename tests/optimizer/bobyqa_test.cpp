// SPDX-License-Identifier: Apache-2.0
#include "optimizer_behaviour.hpp"

namespace bobyqa_test {

std::shared_ptr<const marrow::Optimizer> bobyqa() { return optimizer_behaviour::made_by("optimizer.bobyqa"); }

TEST(Bobyqa, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*bobyqa()); }
TEST(Bobyqa, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*bobyqa()); }
TEST(Bobyqa, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*bobyqa()); }
TEST(Bobyqa, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*bobyqa()); }
TEST(Bobyqa, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*bobyqa()); }

TEST(Bobyqa, RefusesOneDimension) {
  marrow::MinimisationProblem problem;
  problem.function = [](const Eigen::VectorXd& x) { return x.squaredNorm(); };
  problem.start = problem.initial_step = Eigen::VectorXd::Ones(1);
  try {
    bobyqa()->minimise(problem);
    FAIL();
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(error.what(), "BOBYQA minimises functions of two or more numbers, got 1; use another optimizer");
  }
}

}  // namespace bobyqa_test
