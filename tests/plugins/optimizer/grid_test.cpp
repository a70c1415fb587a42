// SPDX-License-Identifier: Apache-2.0
#include "optimizer_behaviour.hpp"

namespace grid_test {

std::shared_ptr<const marrow::Optimizer> grid() { return optimizer_behaviour::made_by("optimizer.grid"); }

TEST(Grid, FollowsTheBestAndBecomesFiner) {
  auto problem = optimizer_behaviour::valley();
  problem.function = [](const Eigen::VectorXd& x) { return (x - Eigen::Vector2d(3.21, -0.4)).squaredNorm(); };
  problem.step_tolerance = 1e-4;
  const auto result = grid()->minimise(problem);
  EXPECT_NEAR(result.x[0], 3.21, 1e-3);
  EXPECT_NEAR(result.x[1], -0.4, 1e-3);
  EXPECT_EQ(result.stopped_because, "steps are below the tolerance");
}

TEST(Grid, RefusesAnEvenNumberOfPoints) {
  EXPECT_EQ(shipped::refusal("optimizer.grid", {}, {{"grid_points", std::int64_t{4}}}),
            "grid_points: expected an odd number, so that the middle is one of them, got 4");
}

}  // namespace grid_test
