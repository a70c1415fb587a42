// SPDX-License-Identifier: Apache-2.0
#include "plugins/optimizer/lbfgs.cpp"

#include "optimizer_behaviour.hpp"

TEST(Lbfgs, FindsTheMinimum) { optimizer_behaviour::finds_the_minimum(*lbfgs()); }
TEST(Lbfgs, KeepsToBoundsAndBudget) { optimizer_behaviour::keeps_to_bounds_and_budget(*lbfgs()); }
TEST(Lbfgs, TakesNanForTheWorst) { optimizer_behaviour::takes_nan_for_the_worst(*lbfgs()); }
TEST(Lbfgs, LetsExceptionsPass) { optimizer_behaviour::lets_exceptions_pass(*lbfgs()); }
TEST(Lbfgs, RefusesNonsense) { optimizer_behaviour::refuses_nonsense(*lbfgs()); }
