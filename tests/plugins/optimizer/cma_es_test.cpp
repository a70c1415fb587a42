// SPDX-License-Identifier: Apache-2.0
#include "optimizer_behaviour.hpp"

namespace cma_es_test {

std::shared_ptr<const marrow::Optimizer> cma_es() { return optimizer_behaviour::made_by("optimizer.cma_es"); }

TEST(CmaEs, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*cma_es()); }
TEST(CmaEs, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*cma_es()); }
TEST(CmaEs, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*cma_es()); }
TEST(CmaEs, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*cma_es()); }
TEST(CmaEs, RefusesWhatIsNowhereFinite) { optimizer_behaviour::refuses_what_is_nowhere_finite(*cma_es()); }
TEST(CmaEs, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*cma_es()); }

}  // namespace cma_es_test
