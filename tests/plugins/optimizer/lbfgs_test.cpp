// SPDX-License-Identifier: Apache-2.0
#include "optimizer_behaviour.hpp"

namespace lbfgs_test {

std::shared_ptr<const marrow::Optimizer> lbfgs() { return optimizer_behaviour::made_by("optimizer.lbfgs"); }

TEST(Lbfgs, UsesDerivatives) {
  auto problem = optimizer_behaviour::valley();
  problem.expansion = [&](const Eigen::VectorXd& x) {
    const double bend = x[1] - x[0] * x[0];
    return marrow::MinimisationProblem::Expansion{problem.function(x),
                                                  Eigen::Vector2d(-2 * (1 - x[0]) - 400 * x[0] * bend, 200 * bend),
                                                  Eigen::Matrix2d::Identity()};
  };
  const auto result = lbfgs()->minimise(problem);
  EXPECT_NEAR((result.x - Eigen::Vector2d(1, 1)).norm(), 0, 1e-5);
  EXPECT_LT(result.evaluations, 150);
}

}  // namespace lbfgs_test
