// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "optimizer_behaviour.hpp"

namespace bobyqa_test {

std::shared_ptr<const marrow::Optimizer> bobyqa() { return optimizer_behaviour::made_by("optimizer.bobyqa"); }

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

TEST(Bobyqa, SaysWhichBoundsAreTooNear) {
  auto problem = optimizer_behaviour::valley();
  problem.lower = Eigen::Vector2d(-2, 0.75);
  problem.upper = Eigen::Vector2d(2, 1.25);
  EXPECT_EQ(optimizer_behaviour::refusal_of(*bobyqa(), problem),
            "BOBYQA needs bounds that are two initial steps apart: those of coordinate 2 are 0.5 apart, and its step "
            "is 0.5; use smaller steps or another optimizer");
  problem.initial_step = Eigen::Vector2d(0.5, 0.2);
  const auto result = bobyqa()->minimise(problem);
  // By hand: along the valley y = x^2 from the start, where x is negative, the least is nearest to (1, 1) at y = 0.75.
  EXPECT_LE(result.value, problem.function(Eigen::Vector2d(-std::sqrt(0.75), 0.75)) + 1e-3);
}

}  // namespace bobyqa_test
