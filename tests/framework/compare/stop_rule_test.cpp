// SPDX-License-Identifier: Apache-2.0
// Simulated comparisons that stop by a rule. No cells are run; only their rows are simulated.

#include <iostream>
#include <marrow/compare/bootstrap.hpp>
#include <marrow/domain/random.hpp>

#include "experiment_files.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

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

std::vector<double> equal_shares(std::size_t looks) {
  std::vector<double> shares;
  for (std::size_t k = 1; k <= looks; ++k) shares.push_back(double(k) / double(looks));
  return shares;
}

TEST(Looks, LateLevelsAreThePublishedOnesAndOneLookTakesAll) {
  // z of 4.8769, 3.3570, 2.6803, 2.2898, 2.0310 at five looks, two-sided alpha 0.05, of the spending function like
  // O'Brien and Fleming's (programs for Reboussin, DeMets, Kim and Lan 2000, Control Clin Trials 21:190).
  const std::vector<double> z{4.8769, 3.3570, 2.6803, 2.2898, 2.0310}, levels = levels_of_looks(equal_shares(5));
  ASSERT_EQ(levels.size(), 5u);
  for (std::size_t k = 0; k < 5; ++k) {
    const double expected = std::erfc(z[k] / std::sqrt(2.0));
    EXPECT_NEAR(levels[k] / expected, 1, 1e-3) << "look " << k + 1;
  }
  for (const Spending spending : {Spending::late, Spending::even})
    EXPECT_NEAR(levels_of_looks({1}, 0.1, spending)[0], 0.1, 1e-8);
}

TEST(Looks, EvenLevelsSpendTheFirstShareAtOnce) {
  const std::vector<double> levels = levels_of_looks(equal_shares(10), 0.05, Spending::even);
  EXPECT_NEAR(levels[0], 0.05 * std::log(1 + 0.1 * (std::exp(1.0) - 1)), 1e-9);
  for (const double level : levels) {
    EXPECT_GT(level, 0.007);
    EXPECT_LT(level, 0.014);
  }
}

TEST(Looks, AreAtTheFirstCasesAndEveryFewOfSharesThatRise) {
  EXPECT_EQ(MESSAGE_OF(levels_of_looks({})), "there are no looks; give at least one");
  EXPECT_HAS(MESSAGE_OF(levels_of_looks({0.5, 0.5})), "look 2 has seen the share 0.500000 of the cases");
  EXPECT_HAS(MESSAGE_OF(levels_of_looks({1.1})), "look 1 has seen");
  EXPECT_HAS(MESSAGE_OF(levels_of_looks({1}, 5)), "from 0.001 to 0.5");
  EXPECT_EQ(looks_at(20, 20, 60), (std::vector<std::size_t>{20, 40, 60}));
  EXPECT_EQ(looks_at(7, 20, 30), (std::vector<std::size_t>{7, 27, 30}));
  EXPECT_EQ(looks_at(5, 1, 5), (std::vector<std::size_t>{5}));
  EXPECT_HAS(MESSAGE_OF(looks_at(5, 1, 4)), "begin at 5 cases and end at 4");
}

// The section 'stop' of an experiment, and cases that a command adds to those of the file.

using namespace experiment_files;
using marrow::compare::Experiment;
using marrow::compare::StopRule;

const std::string kSimulated = kHead + "cases: {simulate: {pipeline: s.yaml, seeds: [1, 7, 3]}}\n";
const std::string kGood = kSimulated + kVariants + kMetrics;  // lines 1 to 7

class ExperimentStop : public ExperimentFiles {
 protected:
  /// At line 8, the first after those of kGood.
  void expect_fault(const std::string& text, const std::string& message, const std::string& hint = "") {
    ExperimentFiles::expect_fault(text, 8, message, hint);
  }
  void expect_stop_fault(const std::string& rule, const std::string& message, const std::string& hint = "") {
    expect_fault(kGood + "stop: {" + rule + "}\n", message, hint);
  }
  StopRule rule(const std::string& text) {
    const Experiment experiment = read_good(kGood + "stop: {" + text + "}\n");
    return experiment.stop.value_or(StopRule());
  }
};

const std::string kRest = ", most_cases: 40, look_every: 10";

TEST_F(ExperimentStop, FurtherSeedsFollowTheLargestButFoldersDoNotBecomeMore) {
  const Experiment experiment = read_good(kGood, 2);
  EXPECT_EQ(marrow::names_of(experiment.cases),
            (std::vector<std::string>{"seed-1", "seed-7", "seed-3", "seed-8", "seed-9"}));
  EXPECT_EQ(experiment.cases[4].seed, 9u);
  EXPECT_TRUE(experiment.cases[4].is_simulated);
  EXPECT_EQ(experiment.more_cases, 2u);
  read(kHead + kCases + kVariants + kMetrics, 2);
  ASSERT_EQ(diagnostics.size(), 1u) << diagnostics.text();
  EXPECT_EQ(diagnostics.sorted()[0].message, "further cases need seeds, which these cases do not have");
  EXPECT_EQ(diagnostics.sorted()[0].hint, "use  cases: {simulate: ...}  or  {seeds: 1..20}");
}

TEST_F(ExperimentStop, IsReadWithItsDefaults) {
  const StopRule difference = rule("difference: number.value" + kRest);
  EXPECT_EQ(difference.goal, StopRule::Goal::difference);
  EXPECT_EQ(difference.metric, 0u);
  EXPECT_EQ(difference.variant, 1u) << "the only one beside the baseline";
  EXPECT_EQ(difference.alpha, 0.05);
  EXPECT_EQ(difference.looks(), (std::vector<std::size_t>{3, 13, 23, 33, 40}));
  const StopRule width = rule("figure: number.value, width: 0.25" + kRest);
  EXPECT_EQ(width.goal, StopRule::Goal::width);
  EXPECT_EQ(width.metric, 0u);
  EXPECT_EQ(width.width, 0.25);
  EXPECT_EQ(rule("figure: success, width: 1" + kRest + "}\nsuccess: {number.value: 1").metric, std::nullopt);
  EXPECT_EQ(rule("difference: number.value, variant: two, alpha: 0.01" + kRest).alpha, 0.01);
  const Experiment experiment = read_good(kGood + "stop: {difference: number.value" + kRest + "}\n", 10);
  EXPECT_EQ(experiment.cases.size(), 13u);
  EXPECT_EQ(experiment.stop->looks(), (std::vector<std::size_t>{3, 13, 23, 33, 40}));
}

TEST_F(ExperimentStop, FaultsOfKeys) {
  const std::string
      either = "'stop' must name either a figure or a difference",
      example =
          "write it as  stop: {figure: errors.distal.final.mtre_mm, width: 0.05, most_cases: 300, "
          "look_every: 20}  or  {difference: errors.distal.final.mtre_mm, most_cases: 300, look_every: 20}";
  expect_fault(kGood + "stop: early\n", "'stop' must be a map, got 'early'", "write it as  key: value  lines");
  expect_stop_fault("figur: number.value, figure: number.value, width: 1" + kRest, "unknown key 'figur' in 'stop'",
                    "did you mean 'figure'?");
  expect_stop_fault("most_cases: 40, look_every: 10", either, example);
  expect_stop_fault("figure: number.value, difference: number.value, width: 1" + kRest, either, example);
  expect_stop_fault("figure: number.value" + kRest, "'stop' does not say how wide the interval may be",
                    "add  width: 0.05");
  expect_stop_fault("difference: number.value, width: 1" + kRest, "'width' belongs to a figure, not to a difference");
  expect_stop_fault("figure: number.value, width: 1, variant: two" + kRest,
                    "'variant' belongs to a difference, not to a figure");
  expect_stop_fault("figure: number.value, width: 1, alpha: 0.1" + kRest,
                    "'alpha' belongs to a difference, not to a figure");
  expect_stop_fault("difference: number.value, look_every: 10", "'stop' does not say where it ends",
                    "add  most_cases: 300");
  expect_stop_fault("difference: number.value, most_cases: 10", "'stop' does not say how often to look",
                    "add  look_every: 20");
}

TEST_F(ExperimentStop, FaultsOfValuesAndNames) {
  expect_stop_fault("figure: number.value, width: 0" + kRest, "'width' must be above 0, got 0");
  expect_stop_fault("figure: number.value, width: narrow" + kRest, "width: expected a number, got 'narrow'");
  expect_stop_fault("figure: success, width: 1" + kRest,
                    "there is no success rate to wait for: no figure has a limit under 'success'",
                    "add  success: {number.value: 2}");
  expect_stop_fault("figure: success, width: 2" + kRest + "}\nsuccess: {number.value: 1",
                    "the interval of a success rate is never wider than 1, got 2");
  expect_stop_fault("difference: number.value, alpha: 5" + kRest, "'alpha' must be 0.001 to 0.5, got 5");
  expect_stop_fault("difference: number.value, most_cases: 40, look_every: 0",
                    "'look_every' must be 1 to 100000, got 0");
  expect_stop_fault("difference: number.value, most_cases: 2, look_every: 1",
                    "'most_cases' is 2, but there are 3 cases already");
  expect_stop_fault("difference: number.value, most_cases: 1000, look_every: 1",
                    "the rule makes 998 looks, at most 200 are possible",
                    "look at more cases at once, as  look_every: 6");
  expect_stop_fault("difference: number.valeu" + kRest, "'number.valeu' is not among the metrics",
                    "did you mean 'number.value'?");
  expect_stop_fault("figure: succes, width: 1" + kRest, "'succes' is not among the metrics", "did you mean 'success'?");
  expect_stop_fault("difference: number.value, variant: one" + kRest, "there is no variant 'one' beside the baseline",
                    "known: two");
  expect_fault(kSimulated + "variants:\n  one: {}\n\n" + kMetrics + "stop: {difference: number.value" + kRest + "}\n",
               "there is no variant beside the baseline to differ from it");
  expect_fault(kSimulated + "variants: {one: {}, two: {c.value: 2},\n  three: {c.value: 3}}\n\n" + kMetrics +
                   "stop: {difference: number.value" + kRest + "}\n",
               "'stop' does not say which variant must differ from the baseline", "add  variant: two");
  expect_fault(kHead + kCases + kVariants + kMetrics + "stop: {difference: number.value" + kRest + "}\n",
               "'stop' needs cases that are made from seeds, because only these can become more",
               "use  cases: {simulate: ...}  or  {seeds: 1..20}");
}

}  // namespace stop_rule_test
