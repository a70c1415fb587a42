// SPDX-License-Identifier: Apache-2.0
#include <cmath>

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
TEST(Direct, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*direct()); }
TEST(Direct, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*direct()); }

}  // namespace direct_test
