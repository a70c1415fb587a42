// SPDX-License-Identifier: Apache-2.0
// Experiment files: what they come to, and every diagnostic at its place.
#include "marrow/compare/experiment.hpp"

#include <set>

#include "runtime/fixture.hpp"

namespace {

using marrow::Diagnostics;
using marrow::compare::Experiment;

constexpr const char* kPipeline = "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  c: {uses: test.constant, with: {path: $case, value: 1}}\n"
                                  "  n: {uses: test.add, in: {a: c, b: c}}\n  f: {uses: test.fail_above, in: {a: n}, with: {value: 9}}\n"
                                  "  t: {uses: test.truth}\noutputs: {number: n, other: f, truth: t}\n";
constexpr const char* kHead = "experiment: 1\npipeline: p.yaml\n";
constexpr const char* kCases = "cases: {folders: [cases/*]}\n";
constexpr const char* kVariants = "variants:\n  one: {}\n  two: {c.value: 2}\n";
constexpr const char* kMetrics = "metrics: [number.value]\n";

class ExperimentTest : public testing::Test {
 protected:
  ExperimentTest() {
    scratch.write("p.yaml", kPipeline);
    for (const char* name : {"b", "a"}) std::filesystem::create_directories(scratch.path / "cases" / name);
  }
  Experiment read(const std::string& text) {
    diagnostics = Diagnostics();
    return marrow::compare::read_experiment(scratch.write("e.yaml", text), test_catalogue(), diagnostics);
  }
  void expect_fault(const std::string& text, int line, const std::string& message, const std::string& hint = "") {
    read(text);
    ASSERT_EQ(diagnostics.size(), 1u) << text << diagnostics.text();
    const marrow::Diagnostic fault = diagnostics.sorted()[0];
    EXPECT_EQ(fault.place.line, line) << diagnostics.text();
    EXPECT_NE(fault.message.find(message), std::string::npos) << diagnostics.text();
    EXPECT_NE(fault.hint.find(hint), std::string::npos) << diagnostics.text();
  }
  Scratch scratch;
  Diagnostics diagnostics;
};

TEST_F(ExperimentTest, FoldersVariantsAndSuccess) {
  const Experiment e = read(std::string(kHead) + kCases + kVariants + kMetrics + "success: {number.value: 3}\nbaseline: two\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  ASSERT_EQ(e.cases.size(), 2u);
  EXPECT_EQ(e.cases[0].name, "a");
  EXPECT_EQ(e.baseline, 1u);
  EXPECT_EQ(e.metrics[0].success_below, 3.0);
  EXPECT_EQ(e.cell_count(), 4u);
  EXPECT_EQ(marrow::compare::cell_id(e, {1, 0, 0}), "two/a/0");
  EXPECT_EQ(marrow::compare::cell_of(e, "two/a/0")->variant, 1u);
  EXPECT_FALSE(marrow::compare::cell_of(e, "three/a/0"));
  const auto arguments = marrow::compare::arguments_of(e, {1, 0, 0}, e.cases[0].folder);
  ASSERT_EQ(arguments.overrides.size(), 1u);
  EXPECT_EQ(arguments.overrides[0].key + "=" + arguments.overrides[0].value, "c.value=2");
}

TEST_F(ExperimentTest, MetricsHaveNamesForPeople) {
  const Experiment e = read(std::string(kHead) + kCases + kVariants + "metrics:\n  - {figure: number.value, label: Sum}\n  - other.value\nsuccess: {number.value: 3}\n");
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  ASSERT_EQ(e.metrics.size(), 2u);
  EXPECT_EQ(e.metrics[0].path + " " + e.metrics[0].label, "number.value Sum");
  EXPECT_EQ(e.metrics[0].success_below, 3.0);
  EXPECT_EQ(e.metrics[1].label, "other.value");
}

TEST_F(ExperimentTest, WhatIsSetForAllComesBeforeWhatAVariantChanges) {
  const std::string set = "set: {f.value: 3, c.word: two, c.uses: test.constant}\n";
  const Experiment e = read(std::string(kHead) + kCases + set + kVariants + kMetrics);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  const auto text = [&](std::size_t variant) {
    std::string all;
    for (const auto& one : marrow::compare::arguments_of(e, {variant, 0, 0}, e.cases[0].folder).overrides) all += one.key + "=" + one.value + " ";
    return all;
  };
  EXPECT_EQ(text(0), "c.uses=test.constant f.value=3 c.word=two ");
  EXPECT_EQ(text(1), "c.uses=test.constant f.value=3 c.word=two c.value=2 ");
  EXPECT_EQ(e.variants[0].overrides.size(), 0u) << "what all have in common tells no variant from another";
}

TEST_F(ExperimentTest, MatrixGivesEveryCombination) {
  const Experiment e = read(std::string(kHead) + kCases + "matrix:\n  c.value: [1, 2, 3]\n  n.uses: [test.add, test.add]\n" + kMetrics);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  ASSERT_EQ(e.variants.size(), 6u);
  std::set<std::string> names;
  for (const auto& variant : e.variants) names.insert(variant.name);
  EXPECT_EQ(names.size(), 6u) << "no two have one name";
  EXPECT_TRUE(names.contains("2+add"));
}

TEST_F(ExperimentTest, StartsAreDrawnByTheirProtocol) {
  std::string pipeline = kPipeline;
  pipeline.insert(pipeline.find("  t:"), "  s: {uses: test.displaced}\n");
  scratch.write("p.yaml", pipeline);
  const std::string text = std::string(kHead) + kCases + kVariants + kMetrics + "starts: {node: s, count: 2000, seed: 7, rotation_deg: 3, translation_mm: 5}\n";
  const Experiment e = read(text);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  ASSERT_EQ(e.starts.size(), 2000u);
  double longest = 0, mean = 0, x = 0, angle = 0;
  for (const auto& start : e.starts) {
    const double length = std::hypot(start.translation_mm[0], start.translation_mm[1], start.translation_mm[2]);
    longest = std::max(longest, length);
    mean += length / 2000;
    x += start.translation_mm[0] / length / 2000;
    angle = std::max(angle, std::hypot(start.rotation_deg[0], start.rotation_deg[1], start.rotation_deg[2]));
  }
  EXPECT_LE(longest, 5);
  EXPECT_GT(longest, 4.9);
  EXPECT_NEAR(mean, 2.5, 0.1) << "the length is uniform";
  EXPECT_NEAR(x, 0, 0.04) << "no direction is preferred";
  EXPECT_LE(angle, 3);
  EXPECT_EQ(read(text).starts[5].rotation_deg, e.starts[5].rotation_deg) << "the seed decides";
}

TEST_F(ExperimentTest, SimulatedCasesDrawTheirInputs) {
  scratch.write("s.yaml", "marrow: 1\ninputs: {x: {type: number, default: 0}, shape: {type: integer, default: 1}}\nnodes:\n"
                          "  c: {uses: test.constant, with: {value: $x, count: $shape}}\noutputs: {case: c}\n");
  const Experiment e = read(std::string(kHead) + "cases: {simulate: {pipeline: s.yaml, seeds: 3..5, set: {c.word: two}, draw: {x: [-2, 2]}, seed_input: [shape]}}\n" + kVariants + kMetrics);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  ASSERT_EQ(e.cases.size(), 3u);
  EXPECT_EQ(marrow::compare::simulation_arguments_of(e, 0).overrides.at(0).key, "c.word");
  EXPECT_EQ(e.cases[2].name, "seed-5");
  EXPECT_EQ(e.cases[2].seed, 5u);
  EXPECT_EQ(e.cases[2].inputs[1].name + "=" + e.cases[2].inputs[1].value, "shape=5");
  EXPECT_LE(std::abs(std::stod(e.cases[2].inputs[0].value)), 2);
  EXPECT_NE(e.cases[1].inputs[0].value, e.cases[2].inputs[0].value);
}

TEST_F(ExperimentTest, WhatIsMissing) {
  expect_fault(std::string("pipeline: p.yaml\n") + kCases + kVariants + kMetrics, 1, "the key 'experiment' is missing", "experiment: 1");
  expect_fault(std::string("experiment: 1\n") + kCases + kVariants + kMetrics, 1, "the key 'pipeline' is missing");
  expect_fault(std::string(kHead) + kVariants + kMetrics, 1, "the key 'cases' is missing");
  expect_fault(std::string(kHead) + kCases + kVariants, 1, "the key 'metrics' is missing");
  expect_fault(std::string(kHead) + kCases + kMetrics, 1, "there are no variants");
}
TEST_F(ExperimentTest, UnknownKey) {
  expect_fault(std::string(kHead) + kCases + kVariants + kMetrics + "basline: one\n", 8, "unknown key 'basline'", "did you mean 'baseline'?");
}
TEST_F(ExperimentTest, UnknownOptionOfAVariantIsAtItsLine) {
  expect_fault(std::string(kHead) + kCases + "variants:\n  one: {}\n  two: {c.vlaue: 2}\n" + kMetrics, 6, "'test.constant' has no option 'vlaue'", "did you mean 'value'?");
}
TEST_F(ExperimentTest, UnknownNodeOfAVariant) {
  expect_fault(std::string(kHead) + kCases + "variants:\n  two: {d.value: 2}\n" + kMetrics, 5, "the pipeline has no node 'd'", "did you mean 'c'?");
}
TEST_F(ExperimentTest, WhatIsSetIsCheckedAtItsLine) {
  const auto with = [](const std::string& set) { return std::string(kHead) + kCases + "set:\n  f.value: 3\n  " + set + "\n" + kVariants + kMetrics; };
  expect_fault(with("c.vlaue: 2"), 6, "'test.constant' has no option 'vlaue'", "did you mean 'value'?");
  expect_fault(with("d.value: 2"), 6, "the pipeline has no node 'd'", "did you mean 'c'?");
  expect_fault(with("c.value: 2000"), 6, "1000");
  expect_fault(with("c.numbers: [1,\n    two]"), 6, "expected a number, got 'two'");
  expect_fault(with("n.in.a: [c, d]"), 6, "takes one metrics, not a list");
  expect_fault(with("n.in.a: d"), 6, "there is no node 'd'");
  expect_fault(with("n: 1"), 6, "an override is node.option=value");
  expect_fault(std::string(kHead) + kCases + "set: [c.value]\n" + kVariants + kMetrics, 4, "'set' must be a map, got a list");
}
TEST_F(ExperimentTest, ValueOutOfRangeInTheMatrix) {
  expect_fault(std::string(kHead) + kCases + "matrix:\n  c.value: [1, 2000]\n" + kMetrics, 5, "1000");
}
TEST_F(ExperimentTest, FaultOfThePipelineIsSaidOnce) {
  scratch.write("p.yaml", std::string(kPipeline) + "extra: 1\n");
  read(std::string(kHead) + kCases + kVariants + kMetrics);
  EXPECT_EQ(diagnostics.size(), 1u) << diagnostics.text();
  EXPECT_NE(diagnostics.text().find("p.yaml:9:1: error: unknown key 'extra'"), std::string::npos) << diagnostics.text();
}
TEST_F(ExperimentTest, UnknownMetric) {
  expect_fault(std::string(kHead) + kCases + kVariants + "metrics: [nubmer.value]\n", 7, "has no output 'nubmer'", "did you mean 'number'?");
  expect_fault(std::string(kHead) + kCases + kVariants + "metrics: [truth.value]\n", 7, "output 'truth' is truth, not figures of merit");
  expect_fault(std::string(kHead) + kCases + kVariants + "metrics: [number]\n", 7, "'number' does not say which figure");
}
TEST_F(ExperimentTest, SuccessOfWhatIsNoMetric) {
  expect_fault(std::string(kHead) + kCases + kVariants + kMetrics + "success: {number.valeu: 1}\n", 8, "'number.valeu' is not among the metrics", "did you mean 'number.value'?");
}
TEST_F(ExperimentTest, UnknownBaseline) {
  expect_fault(std::string(kHead) + kCases + kVariants + kMetrics + "baseline: tow\n", 8, "there is no variant 'tow'", "did you mean 'two'?");
}
TEST_F(ExperimentTest, NoCasesThere) {
  expect_fault(std::string(kHead) + "cases: {folders: [nothing/*]}\n" + kVariants + kMetrics, 3, "there is nothing at 'nothing/*'");
}
TEST_F(ExperimentTest, BadNamesSeedsAndRanges) {
  expect_fault(std::string(kHead) + kCases + "variants:\n  a/b: {}\n" + kMetrics, 5, "a variant's name becomes a file name");
  expect_fault(std::string(kHead) + "cases: {simulate: {pipeline: p.yaml, seeds: 5..1}}\n" + kVariants + kMetrics + "", 3, "'seeds' must be a range such as 1..20");
  expect_fault(std::string(kHead) + "cases: {simulate: {pipeline: p.yaml, seeds: 1..2, draw: {x: [3, 1]}}}\n" + kVariants + kMetrics, 3, "ends before it begins");
}
TEST_F(ExperimentTest, StartsWithoutNodeOrCount) {
  expect_fault(std::string(kHead) + kCases + kVariants + kMetrics + "starts: {count: 3}\n", 8, "'starts' does not say which node is displaced");
  expect_fault(std::string(kHead) + kCases + kVariants + kMetrics + "starts: {node: c, count: 0}\n", 8, "'count' must be 1 to 100000, got 0");
}

}  // namespace
