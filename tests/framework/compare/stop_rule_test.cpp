// SPDX-License-Identifier: Apache-2.0
// Simulated comparisons that stop by a rule. No cells are run; only their rows are simulated.
#include <gtest/gtest.h>

#include <iostream>
#include <limits>
#include <marrow/compare/median_interval.hpp>
#include <marrow/compare/stop_rule.hpp>
#include <marrow/domain/random.hpp>

#include "tests/harness/message_of.hpp"

namespace stop_rule_test {

using namespace marrow::compare;

constexpr int kExperiments = 500;

StopRule difference_rule() {
  StopRule rule;
  rule.goal = StopRule::Goal::difference;
  rule.metric = 0;
  rule.variant = 1;
  rule.first_cases = rule.look_every = 20;
  rule.most_cases = 200;
  return rule;
}

/// The outcome of many experiments, each looked at until the rule says stop.
struct Outcome {
  int shown = 0, shown_by_usual_p = 0, held = 0;
  double mean_cases = 0;
};

/// Two starts of each case. The difference scatters by 1 from case to case, and ten times that in every tenth case.
Outcome many_experiments(const StopRule& rule, double shift) {
  const StopPlan plan(rule);
  Outcome outcome;
  for (int i = 0; i < kExperiments; ++i) {
    marrow::Random random(std::uint64_t(i) + 1);
    std::vector<Pair> pairs;
    bool usual = false;
    for (const std::size_t cases : plan.looks()) {
      for (std::size_t c = pairs.size() / 2; c < cases; ++c) {
        const double of_case = shift + (random.uniform() < 0.1 ? 10 : 1) * random.normal();
        for (int start = 0; start < 2; ++start)
          pairs.push_back({"seed-" + std::to_string(c), 5, 5 + of_case + 0.3 * random.normal()});
      }
      const Look look = look_at_difference(plan, cases, pairs, false);
      usual = usual || look.p < 0.05;
      if (!look.is_met && !look.is_last()) continue;
      outcome.shown += look.is_met;
      outcome.held += look.interval.lower <= shift && shift <= look.interval.upper;
      outcome.mean_cases += double(cases) / kExperiments;
      break;
    }
    outcome.shown_by_usual_p += usual;
  }
  return outcome;
}

TEST(StopRule, ShowsNoDifferenceWhereThereIsNoneThoughItLooksTenTimes) {
  const Outcome outcome = many_experiments(difference_rule(), 0);
  std::cout << "without a difference: shown in " << outcome.shown << " of " << kExperiments
            << " (p < 0.05 at any look in " << outcome.shown_by_usual_p << "), 0 in the interval at the end in "
            << outcome.held << "\n";
  const Interval interval = wilson_interval(std::size_t(outcome.shown), kExperiments, 0.99);
  EXPECT_LE(interval.lower, 0.05);
  EXPECT_GE(outcome.shown, 5) << "it spends its alpha";
  EXPECT_GE(outcome.shown_by_usual_p, 0.15 * kExperiments) << "the looks would matter";
  EXPECT_GE(outcome.held, 0.94 * kExperiments);
}

TEST(StopRule, StopsEarlyWhereThereIsADifference) {
  const Outcome outcome = many_experiments(difference_rule(), 0.8);
  std::cout << "with a difference of 0.8: shown in " << outcome.shown << " of " << kExperiments << ", after "
            << outcome.mean_cases << " cases in the mean, in the interval at the end in " << outcome.held << "\n";
  EXPECT_GE(outcome.shown, 0.98 * kExperiments);
  EXPECT_LE(outcome.mean_cases, 100);
  EXPECT_GE(outcome.held, 0.94 * kExperiments);
}

TEST(StopRule, NarrowIntervalsHoldTheTrueValueThoughTheyWereChosen) {
  StopRule rule = difference_rule();
  rule.goal = StopRule::Goal::width;
  rule.width = 0.9;
  rule.most_cases = 120;
  const StopPlan plan(rule);
  int held = 0, usual_held = 0;
  constexpr int kTrials = 500;
  for (int i = 0; i < kTrials; ++i) {
    marrow::Random random(std::uint64_t(i) + 1);
    ValuesOfCases cases;
    bool usual_met = false;
    for (const std::size_t count : plan.looks()) {
      while (cases.size() < count) cases.push_back({random.normal()});
      const std::optional<Interval> usual = median_interval_of(cases),
                                    own = median_interval_of(cases, 1 - plan.level_at(count));
      const auto holds = [](const Interval& one) { return one.lower <= 0 && one.upper >= 0; };
      if (!usual_met && usual->upper - usual->lower <= rule.width) {
        usual_met = true;
        usual_held += holds(*usual);
      }
      const Look look = look_at_widths(plan, count, {own});
      if (!look.is_met && !look.is_last()) continue;
      held += holds(*own);
      break;
    }
  }
  std::cout << "narrow intervals hold the median in " << held << " of " << kTrials << ", usual ones in " << usual_held
            << "\n";
  EXPECT_GE(held, 0.94 * kTrials);
  EXPECT_LT(usual_held, held);
}

TEST(StopRule, TheWidestIntervalDecides) {
  StopRule rule = difference_rule();
  rule.goal = StopRule::Goal::width;
  rule.width = 0.1;
  const StopPlan plan(rule);
  const Interval narrow{1, 1.1 - 1e-9}, wide{1, 1.2};
  EXPECT_TRUE(look_at_widths(plan, 40, {narrow, narrow}).is_met);
  const Look look = look_at_widths(plan, 40, {narrow, wide, narrow});
  EXPECT_FALSE(look.is_met);
  EXPECT_EQ(look.variant, 1u);
  EXPECT_EQ(look.number, 2u);
  EXPECT_EQ(look.looks, 10u);
  EXPECT_FALSE(look_at_widths(plan, 200, {narrow, std::nullopt}).is_met);
  EXPECT_TRUE(look_at_widths(plan, 200, {narrow}).is_last());
  EXPECT_EQ(MESSAGE_OF(look_at_widths(plan, 50, {narrow})), "the rule has no look at 50 cases");
  EXPECT_EQ(MESSAGE_OF(look_at_widths(plan, 40, {})), "there are no variants to look at; give at least one");
}

TEST(StopRule, SaysWhatItFoundAndWhatThatMeans) {
  StopRule rule = difference_rule();
  Look look = look_at_difference(StopPlan(rule), 20, {}, false);
  EXPECT_FALSE(look.is_met);
  const LookNames names{"mTRE", "mm", "canny", "sobel"};
  EXPECT_EQ(sentence(rule, look, names).substr(0, 80),
            "look 1 of 10, 20 cases: canny is not shown to differ from sobel in mTRE: p = 1, ");
  EXPECT_HAS(sentence(rule, look, names), "; --more-cases goes on, with 20 cases a look");
  look.number = 10;
  look.cases = 200;
  look.p = 0.001;
  look.level = 0.04;
  look.is_met = true;
  look.difference = 0.12;
  look.interval = {0.05, 0.2, 0.96};
  EXPECT_EQ(
      sentence(rule, look, names),
      "look 10 of 10, 200 cases: canny differs from sobel in mTRE: p = 0.001, below 0.04; the rule says stop. The "
      "median difference is 0.12 mm, within 0.05 to 0.2 mm, which holds with 95 % confidence over all looks");
  look.difference = look.interval.upper = std::numeric_limits<double>::infinity();
  EXPECT_HAS(sentence(rule, look, names), "The median difference is a failure, within 0.05 mm to a failure, which");
  look.interval.lower = look.interval.upper;
  EXPECT_HAS(sentence(rule, look, names), "The median difference is a failure, which holds with 95 %");
  look.difference = 0.12;
  look.interval = {0.05, 0.2, 0.96};
  look.is_met = false;
  EXPECT_HAS(sentence(rule, look, names), "; this was the last look. The median");
  look.interval.lower = -0.05;
  EXPECT_HAS(sentence(rule, look, names), ": p = 0.001, below 0.04, but the interval contains 0; this was");
  look.interval.lower = 0.05;
  EXPECT_HAS(sentence(rule, look, names), ": p = 0.001, below 0.04, but the ranks and the median do not agree; this");
  rule.goal = StopRule::Goal::width;
  rule.width = 0.1;
  EXPECT_EQ(
      sentence(rule, look, {"the success rate", "", "canny", "sobel"}),
      "look 10 of 10, 200 cases: the widest interval of the success rate is 0.15 wide, more than 0.1; this was the "
      "last look. It is canny's, 0.05 to 0.2, which holds with 95 % confidence over all looks");
  EXPECT_EQ(
      sentence(rule, look_at_widths(StopPlan(rule), 20, {std::nullopt}), {"the success rate", "", "canny", "sobel"}),
      "look 1 of 10, 20 cases: canny: too few cases for an interval of the success rate; --more-cases goes on, with "
      "20 cases a look");
}

}  // namespace stop_rule_test
