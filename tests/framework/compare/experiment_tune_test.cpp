// SPDX-License-Identifier: Apache-2.0
// The section 'tune' of an experiment.
#include "experiment_files.hpp"

namespace experiment_tune_test {

using namespace experiment_files;
using marrow::compare::Experiment;
using marrow::compare::TuneRule;

const std::string kGood = kStart + kMetrics;  // lines 1 to 4
const std::string kBy = "optimizer: {uses: optimizer.nelder_mead}, ";
const std::string kRest = kBy + "points: 9, training_cases: 1, failed_as: 5";

/// Nodes of the tests, and the optimizers.
const marrow::Catalogue& catalogue() {
  const std::filesystem::path build = MARROW_BINARY_DIR;
  static const marrow::Catalogue catalogue({build / "tests" / "plugins", build / "lib" / "marrow"});
  return catalogue;
}

class ExperimentTune : public ExperimentFiles {
 protected:
  ExperimentTune() : ExperimentFiles(catalogue()) {}
  Experiment good(const std::string& tune, const std::string& more = "") {
    Experiment experiment = read_good(kGood + more + "tune: {" + tune + "}\n");
    return experiment;
  }
  void expect_fault(const std::string& tune, const std::string& message, const std::string& hint = "",
                    const std::string& more = "") {
    ExperimentFiles::expect_fault(kGood + "tune: {" + tune + "}\n" + more, 5, message, hint);
  }
};

TEST_F(ExperimentTune, ThePipelineAsItIsIsTheVariant) {
  const Experiment experiment = good("options: {c.value: [10, 20]}, " + kRest);
  ASSERT_EQ(experiment.variants.size(), 1u);
  EXPECT_EQ(experiment.variants[0].name, "untuned");
  EXPECT_EQ(experiment.tune->optimizer, "optimizer.nelder_mead");
  EXPECT_EQ(experiment.tune->points, 9u);
  EXPECT_EQ(experiment.tune->failed_as, 5);
}

TEST_F(ExperimentTune, ATunedVariantIsNamedAfterItsValues) {
  Experiment experiment =
      good("options: {c.value: [10, 20], c.count: {range: [1, 3], whole: true}}, variant: two, " + kRest,
           "variants:\n  one: {}\n  two: {c.word: two}\n");
  EXPECT_EQ(add_tuned(experiment, std::vector<double>{12.34, 2}), "tuned+12.34+2");
  const marrow::compare::Variant tuned = experiment.variants.back();
  ASSERT_EQ(tuned.overrides.size(), 3u);
  EXPECT_EQ(tuned.overrides[0].key, "c.word") << "those of the variant come first";
  EXPECT_EQ(tuned.overrides[0].value, "two");
  EXPECT_EQ(tuned.overrides[1].value, "12.34");
  EXPECT_EQ(tuned.overrides[2].value, "2");
  experiment.variants.pop_back();
  EXPECT_TRUE(add_tuned(experiment, std::string("tuned+12.34+2")));
  EXPECT_EQ(experiment.variants.back().overrides[1].value, "12.34");
  for (const char* other : {"tuned", "tuned+12", "tuned+12+2+3", "tuned+12.0+2", "tuned+9+2", "tuned+12+x", "one+12+2"})
    EXPECT_FALSE(add_tuned(experiment, std::string(other))) << other;
  EXPECT_EQ(experiment.variants.size(), 3u);
}

TEST_F(ExperimentTune, ValuesAreRounded) {
  TuneRule rule = *good("options: {c.value: [10, 20], c.path: {range: [0.7, 2.8], scale: log}}, " + kRest).tune;
  EXPECT_EQ(rule.values_at({0, 0}), (std::vector<double>{10, 0.7}));
  EXPECT_EQ(rule.values_at({1, 1}), (std::vector<double>{20, 2.8}));
  EXPECT_EQ(rule.values_at({0.123456, 0.5}), (std::vector<double>{11.23, 1.4}));
  EXPECT_EQ(rule.values_at({-1, 2}), (std::vector<double>{10, 2.8}));
}

TEST_F(ExperimentTune, CasesAreSplitAndAFailedRunCountsAsTenTimesTheLimit) {
  Experiment training = good("options: {c.value: [10, 20]}, " + kRest), held_out = training;
  keep_training_cases(training);
  keep_held_out_cases(held_out);
  ASSERT_EQ(training.cases.size(), 1u);
  ASSERT_EQ(held_out.cases.size(), 1u);
  EXPECT_EQ(training.cases[0].name, "a");
  EXPECT_EQ(held_out.cases[0].name, "b");
  const Experiment experiment =
      good("options: {c.value: [10, 20]}, " + kBy + "points: 9, training_cases: 1", "success: {number.value: 0.3}\n");
  EXPECT_DOUBLE_EQ(experiment.tune->failed_as, 3);
}

TEST_F(ExperimentTune, AFailedRunCountsAsNoSuccess) {
  const std::string by = "options: {c.value: [10, 20]}, " + kBy + "points: 9, training_cases: 1";
  const auto says_nothing = [&](const std::string& limit) {
    expect_fault(
        by, "'tune' does not say what a failed run counts as",
        "add  failed_as:  with a bad value of number.value; with a limit above 0 under 'success' it is ten times "
        "that limit",
        "success: {number.value: " + limit + "}\n");
  };
  says_nothing("0");   // ten times 0 would make a failed run as good as the best
  says_nothing("-5");  // -50 would be better than any
  const std::string hint = "let  failed_as  be a value that is no success", limit = "success: {number.value: 0.3}\n";
  expect_fault(by + ", failed_as: 0.2",
               "a failed run would count as 0.2, which is a success: the limit of number.value is 0.3", hint, limit);
  EXPECT_EQ(good(by + ", failed_as: 0.3", limit).tune->failed_as, 0.3) << "success is below the limit";
  const auto better = [&](const std::string& direction, const std::string& failed_as) {
    return kGood.substr(0, kGood.find("metrics")) + "metrics: [{figure: number.value, better: " + direction + "}]\n" +
           limit + "tune: {" + by + failed_as + "}\n";
  };
  EXPECT_EQ(read(better("nearest_zero", ", failed_as: -4")).tune->failed_as, 4) << "values are magnitudes";
  EXPECT_EQ(read(better("higher", ", failed_as: 0.1")).tune->failed_as, 0.1);
  read(better("higher", ", failed_as: 0.4"));
  EXPECT_EQ(diagnostics.sorted()[0].message,
            "a failed run would count as 0.4, which is a success: the limit of number.value is 0.3");
  read(better("higher", ""));
  EXPECT_EQ(diagnostics.sorted()[0].hint, "add  failed_as:  with a bad value of number.value");
}

TEST_F(ExperimentTune, EachFaultIsSaid) {
  const std::string options = "options: {c.value: [10, 20]}, ", by = options + kBy;
  const std::string example =
      "write it as  tune: {options: {edges.high: [60, 90]}, optimizer: {uses: NAME}, points: 40, training_cases: 20}";
  expect_fault("points: 9, training_cases: 1", "'tune' names no option", example);
  expect_fault(by + "training_cases: 1, failed_as: 5", "'tune' does not say how many points may be tried",
               "add  points: 40");
  expect_fault(by + "points: 9, failed_as: 5", "'tune' does not say how many cases are for training",
               "add  training_cases: 20");
  expect_fault(by + "points: 9, failed_as: 5, training_cases: 2", "2 training cases of 2 leave none that is held out");
  expect_fault(
      by + "points: 9, training_cases: 1", "'tune' does not say what a failed run counts as",
      "add  failed_as:  with a bad value of number.value; with a limit above 0 under 'success' it is ten times "
      "that limit");
  expect_fault(options + kRest + ", figure: number.valeu", "'number.valeu' is not among the metrics",
               "did you mean 'number.value'?");
  expect_fault(options + kRest + ", variant: untune", "there is no variant 'untune'", "did you mean 'untuned'?");
  const std::string which = "add  optimizer: {uses: NAME};  marrow list optimizer  shows which there are",
                    rest = "points: 9, training_cases: 1, failed_as: 5";
  expect_fault(options + rest, "'tune' does not name its optimizer", which);
  expect_fault(options + "optimizer: {with: {}}, " + rest, "'optimizer' does not name its node", which);
  expect_fault(options + kRest, "'tune' beside 'sweep'", "make two experiments of them",
               "sweep: {options: {c.count: [1, 2]}, grid: 2}\n");
  expect_fault("options: {c.value: [20, 10]}, " + kRest,
               "the range of 'c.value' must end above its beginning, got 20 to 10");
  expect_fault("options: {c.valu: [10, 20]}, " + kRest, "'test.constant' has no option 'valu'",
               "did you mean 'value'?");
  expect_fault(
      "options: {c.value: [10, 20]}, optimizer: {uses: test.constant}, points: 9, training_cases: 1, failed_as: 5",
      "'test.constant' is no optimizer", "marrow list optimizer  shows which there are");
}

}  // namespace experiment_tune_test
