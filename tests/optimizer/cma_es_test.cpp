// SPDX-License-Identifier: Apache-2.0
#include "plugins/optimizer/cma_es.cpp"

#include "optimizer_behaviour.hpp"

TEST(CmaEs, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*cma_es(Options{})); }
TEST(CmaEs, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*cma_es(Options{})); }
TEST(CmaEs, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*cma_es(Options{})); }
TEST(CmaEs, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*cma_es(Options{})); }
TEST(CmaEs, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*cma_es(Options{})); }
