// SPDX-License-Identifier: Apache-2.0
#include "plugins/optimizer/powell.cpp"

#include "optimizer_behaviour.hpp"

TEST(Powell, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*powell()); }
TEST(Powell, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*powell()); }
TEST(Powell, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*powell()); }
TEST(Powell, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*powell()); }
TEST(Powell, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*powell()); }
