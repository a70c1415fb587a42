// SPDX-License-Identifier: Apache-2.0
#include "optimizer_behaviour.hpp"

namespace powell_test {

std::shared_ptr<const marrow::Optimizer> powell() { return optimizer_behaviour::made_by("optimizer.powell"); }

TEST(Powell, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*powell()); }
TEST(Powell, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*powell()); }
TEST(Powell, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*powell()); }
TEST(Powell, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*powell()); }
TEST(Powell, RefusesWhatIsNowhereFinite) { optimizer_behaviour::refuses_what_is_nowhere_finite(*powell()); }
TEST(Powell, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*powell()); }

}  // namespace powell_test
