// SPDX-License-Identifier: Apache-2.0
#include "optimizer_behaviour.hpp"

namespace nelder_mead_test {

std::shared_ptr<const marrow::Optimizer> nelder_mead() { return optimizer_behaviour::made_by("optimizer.nelder_mead"); }

TEST(NelderMead, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*nelder_mead()); }
TEST(NelderMead, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*nelder_mead()); }
TEST(NelderMead, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*nelder_mead()); }
TEST(NelderMead, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*nelder_mead()); }
TEST(NelderMead, RefusesWhatIsNowhereFinite) { optimizer_behaviour::refuses_what_is_nowhere_finite(*nelder_mead()); }
TEST(NelderMead, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*nelder_mead()); }

}  // namespace nelder_mead_test
