// SPDX-License-Identifier: Apache-2.0
// The section 'stop' of an experiment, and cases that a command adds to those of the file.
#include "experiment_files.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace experiment_stop_test {

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

TEST_F(ExperimentStop, FurtherSeedsFollowTheLargest) {
  const Experiment experiment = read_good(kGood, 2);
  EXPECT_EQ(marrow::names_of(experiment.cases),
            (std::vector<std::string>{"seed-1", "seed-7", "seed-3", "seed-8", "seed-9"}));
  EXPECT_EQ(experiment.cases[4].seed, 9u);
  EXPECT_TRUE(experiment.cases[4].is_simulated);
  EXPECT_EQ(experiment.more_cases, 2u);
}

TEST_F(ExperimentStop, FoldersDoNotBecomeMore) {
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
}

TEST_F(ExperimentStop, LooksStayTheSameWithMoreCases) {
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

TEST_F(ExperimentStop, FaultsOfValues) {
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
}

TEST_F(ExperimentStop, FaultsOfNames) {
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
}

TEST_F(ExperimentStop, NeedsSeedsAndFewEnoughCells) {
  expect_fault(kHead + kCases + kVariants + kMetrics + "stop: {difference: number.value" + kRest + "}\n",
               "'stop' needs cases that are made from seeds, because only these can become more",
               "use  cases: {simulate: ...}  or  {seeds: 1..20}");
}

}  // namespace experiment_stop_test
