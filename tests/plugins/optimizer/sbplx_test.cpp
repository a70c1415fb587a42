// SPDX-License-Identifier: Apache-2.0
#include "optimizer_behaviour.hpp"

namespace sbplx_test {

std::shared_ptr<const marrow::Optimizer> sbplx() { return optimizer_behaviour::made_by("optimizer.sbplx"); }

TEST(Sbplx, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*sbplx()); }
TEST(Sbplx, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*sbplx()); }
TEST(Sbplx, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*sbplx()); }
TEST(Sbplx, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*sbplx()); }
TEST(Sbplx, RefusesWhatIsNowhereFinite) { optimizer_behaviour::refuses_what_is_nowhere_finite(*sbplx()); }
TEST(Sbplx, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*sbplx()); }

}  // namespace sbplx_test
