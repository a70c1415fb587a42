// SPDX-License-Identifier: Apache-2.0
// Every fault of an experiment file, with its text and its line.
#include "experiment_files.hpp"
#include "marrow/base/file_names.hpp"

namespace experiment_faults_test {

using namespace experiment_files;

const std::string kGood = kStart + kVariants + kMetrics;  // lines 1 to 7
const std::string kAfterCases = kVariants + kMetrics;

class ExperimentFaults : public ExperimentFiles {
 protected:
  /// A fault of a line that follows all required lines.
  void expect_fault_of(const std::string& line, const std::string& message, const std::string& hint = "") {
    expect_fault(kGood + line + "\n", 8, message, hint);
  }
  /// A fault of a line of a simulation.
  void expect_simulation_fault(const std::string& line, const std::string& message, const std::string& hint = "") {
    const std::string pipeline = line.starts_with("pipeline") ? "" : "    pipeline: s.yaml\n",
                      seeds = line.starts_with("seeds") ? "" : "    seeds: 1..2\n";
    expect_fault(kHead + "cases:\n  simulate:\n    " + line + "\n" + pipeline + seeds + kAfterCases, 5, message, hint);
  }
};

const char* const kMapHint = "write it as  key: value  lines";
const char* const kStartsHere = "the path starts at the experiment's file";

TEST_F(ExperimentFaults, NoFileOrNoYaml) {
  marrow::compare::read_experiment(scratch.path / "none.yaml", test_catalogue(), diagnostics);
  ASSERT_EQ(diagnostics.size(), 1u);
  EXPECT_HAS(diagnostics.text(),
             "none.yaml: error: the experiment file cannot be read: No such file or directory\n  hint: check the path");
  read("experiment: 1\npipeline: [p.yaml\ncases: {}\n");
  EXPECT_HAS(diagnostics.text(), "e.yaml:2:11: error: this [ is not closed");
  expect_fault("- experiment\n", 1, "the experiment must be a map, got a list of 1", kMapHint);
}

TEST_F(ExperimentFaults, HeadOfTheFile) {
  expect_fault(std::string("pipeline: p.yaml\n") + kCases + kAfterCases, 1, "the key 'experiment' is missing",
               "begin the file with  experiment: 1");
  expect_fault(std::string("experiment: 1\n") + kCases + kAfterCases, 1, "the key 'pipeline' is missing",
               "name the pipeline file whose variants are compared");
  expect_fault(kHead + kAfterCases, 1, "the key 'cases' is missing",
               "say on which data, as  cases: {folders: [...]},  {simulate: ...}  or, where the pipeline makes its "
               "data itself,  {seeds: 1..20}");
  expect_fault(kStart + kVariants, 1, "the key 'metrics' is missing",
               "name the figures to compare, as  metrics: [errors.distal.final.mtre_mm]");
  expect_fault(kStart + kMetrics, 1, "there are no variants",
               "name at least one under  variants:  or options under  matrix:,  sweep:  or  tune:");
  expect_fault_of("basline: one", "unknown key 'basline' in the experiment", "did you mean 'baseline'?");
  expect_fault_of("metrics: [other.value]", "'metrics' is given twice in the experiment", "the first is at line 7");
  expect_fault("experiment: 2\npipeline: p.yaml\n" + kGood.substr(kStart.find("cases")), 1,
               "this file is of format 2, this program reads format 1");
  expect_fault("experiment: one\npipeline: p.yaml\n" + kGood.substr(kStart.find("cases")), 1,
               "experiment: expected an integer, got 'one'");
  expect_fault_of("name: my/edges", "an experiment's name becomes a file name: 'my/edges' cannot be one, it holds '/'",
                  marrow::kNameHint);
  expect_fault_of("name: [edges]", "name: expected a text, got a list of 1");
  expect_fault_of("help: {}", "help: expected a text, got a map");
  expect_fault("experiment: 1\npipeline: q.yaml\n" + kGood.substr(kStart.find("cases")), 2, "there is no file 'q.yaml'",
               kStartsHere);
  expect_fault("experiment: 1\npipeline: [p.yaml]\n" + kGood.substr(kStart.find("cases")), 2,
               "pipeline: expected a text, got a list of 1");
}

TEST_F(ExperimentFaults, Inputs) {
  expect_fault_of("inputs: [1]", "'inputs' must be a map, got a list of 1", kMapHint);
  expect_fault_of("inputs: {x: [1]}", "'x' must be one value");
  expect_fault_of("inputs: {x: $env:MARROW_NOT_SET}", "the environment has no variable 'MARROW_NOT_SET'",
                  "set it, as in  export MARROW_NOT_SET=...");
  expect_fault_of("inputs: {x: '$env:'}", "$env: names no environment variable", "write it as  $env:NAME");
  expect_fault_of("inputs: {csae: 1}", "the pipeline has no input 'csae'", "did you mean 'case'?");
  scratch.write("p.yaml", std::string(kPipeline).insert(kPipeline.find("{case:") + 1, "x: {type: number}, "));
  expect_fault_of("inputs: {x: much}", "input 'x': expected a number, got 'much'");
}

TEST_F(ExperimentFaults, Patches) {
  const auto set = [](const std::string& line) { return kGood + "set:\n  f.value: 3\n  " + line + "\n"; };
  expect_fault(set("c.vlaue: 2"), 10, "'test.constant' has no option 'vlaue'", "did you mean 'value'?");
  expect_fault(set("d.value: 2"), 10, "the pipeline has no node 'd'", "did you mean 'c'?");
  expect_fault(set("c.value: 2000"), 10, "option 'value' of test.constant: 2000 is above the most allowed, 1000");
  expect_fault(set("c.numbers: [1,\n    two]"), 10, "option 'numbers' of test.constant: expected a number, got 'two'");
  expect_fault(set("n.in.a: [c, d]"), 10, "input 'a' of test.add takes one metrics, not a list");
  expect_fault(set("n.in.a: d"), 10, "there is no node 'd'", "did you mean 'c'?");
  expect_fault(set("n: 1"), 10,
               "an override is node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference");
  expect_fault_of("set: [c.value]", "'set' must be a map, got a list of 1", kMapHint);
}

TEST_F(ExperimentFaults, Variants) {
  const auto variants = [](const std::string& lines) { return kStart + kMetrics + lines + "\n"; };
  expect_fault(variants("variants: [one]"), 5, "'variants' must be a map, got a list of 1", kMapHint);
  expect_fault(variants("variants:\n  a/b: {}"), 6,
               "a variant's name becomes a file name: 'a/b' cannot be one, it holds '/'", marrow::kNameHint);
  expect_fault(variants("variants:\n  one: {}\n  one: {}"), 7, "'one' is given twice in 'variants'",
               "the first is at line 6");
  expect_fault(variants("variants:\n  one: c.value"), 6, "variant 'one' must be a map, got 'c.value'", kMapHint);
  expect_fault(variants("variants:\n  one: {}\n  two: {c.vlaue: 2}"), 7, "'test.constant' has no option 'vlaue'",
               "did you mean 'value'?");
  expect_fault(variants("variants:\n  two: {d.value: 2}"), 6, "the pipeline has no node 'd'", "did you mean 'c'?");
}

TEST_F(ExperimentFaults, Matrix) {
  const auto matrix = [](const std::string& lines) { return kStart + kMetrics + lines + "\n"; };
  expect_fault(matrix("matrix: [c.value]"), 5, "'matrix' must be a map, got a list of 1", kMapHint);
  expect_fault(matrix("matrix: {c.value: 1}"), 5, "'c.value' in the matrix must be a list of values",
               "write it as  c.value: [a, b]");
  expect_fault(matrix("matrix: {c.value: []}"), 5, "'c.value' in the matrix must be a list of values",
               "write it as  c.value: [a, b]");
  expect_fault(matrix("matrix:\n  c.value: [1,\n   2000]"), 7,
               "option 'value' of test.constant: 2000 is above the most allowed, 1000");
  expect_fault(matrix("matrix: {c.path: [../a]}"), 5,
               "a variant's name becomes a file name: '.._a' cannot be one, it begins with a dot", marrow::kNameHint);
}

TEST_F(ExperimentFaults, FaultOfThePipelineIsSaidOnce) {
  scratch.write("p.yaml", kPipeline + "extra: 1\n");
  read(kGood);
  EXPECT_EQ(diagnostics.size(), 1u) << diagnostics.text();
  EXPECT_HAS(diagnostics.text(), "p.yaml:9:1: error: unknown key 'extra'");
}

TEST_F(ExperimentFaults, CasesAreNamedByTheirLastWildcard) {
  for (const char* one : {"by/anna/x/case", "by/bela/x/case"}) std::filesystem::create_directories(scratch.path / one);
  scratch.write("by/anna/x/case/case.yaml", "");
  const auto names = [&](const std::string& pattern) {
    std::string text;
    for (const auto& one : read(kHead + ("cases: {folders: [" + pattern + "]}\n") + kAfterCases).cases)
      text += one.name + " ";
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    return text;
  };
  EXPECT_EQ(names("by/*/x/case"), "anna bela ");
  EXPECT_EQ(names("by/*/x/case/"), "anna bela ");
  EXPECT_EQ(names("./by/*/x/case/case.yaml"), "anna ");
  EXPECT_EQ(names("by/anna/x/case"), "case ");
  EXPECT_EQ(names("by/a*"), "anna ");
}

TEST_F(ExperimentFaults, Cases) {
  const auto cases = [](const std::string& lines) { return kHead + ("cases: " + lines) + "\n" + kAfterCases; };
  const std::string no_cases = "name folders, as  folders: [data/*]  or a simulation";
  expect_fault(cases("[cases/*]"), 3, "'cases' must be a map, got a list of 1", kMapHint);
  expect_fault(cases("{folder: [cases/*]}"), 3, "unknown key 'folder' in 'cases'", "did you mean 'folders'?");
  expect_fault(cases("{input: case}"), 3, "there are no cases", no_cases);
  expect_fault(cases("{folders: []}"), 3, "there are no cases", no_cases);
  expect_fault(cases("{folders: cases/*}"), 3, "'folders' must be a list", "write it as  folders: [a, b]");
  expect_fault(cases("\n  folders:\n  - [a]"), 5, "an item of 'folders': expected a text, got a list of 1");
  expect_fault(cases("\n  folders:\n  - nothing/*"), 5, "there is no folder at 'nothing/*'", kStartsHere);
  expect_fault(cases("{folders: [p.yaml]}"), 3, "there is no folder at 'p.yaml'", kStartsHere);
  std::filesystem::create_directories(scratch.path / "more" / "a");
  expect_fault(cases("\n  folders:\n  - cases/*\n  - more/*"), 6, "two cases are named 'a'",
               "they are " + (scratch.path / "cases/a").string() + " and " + (scratch.path / "more/a").string());
  std::filesystem::create_directories(scratch.path / "odd\nfolder" / "a");
  expect_fault(
      cases("\n  folders:\n  - cases/*\n  - odd*/*"), 6, "two cases are named 'a'",
      "they are " + (scratch.path / "cases/a").string() + " and " + (scratch.path / "odd\\x0afolder/a").string());
  expect_fault(cases("{input: [a], folders: [cases/*]}"), 3, "input: expected a text, got a list of 1");
  read(cases("{input: caes, folders: [cases/*]}"));
  EXPECT_EQ(diagnostics.size(), 2u);
  EXPECT_HAS(diagnostics.text(), "e.yaml:3:1: error: the pipeline has no input 'caes'");
  EXPECT_HAS(diagnostics.text(), "p.yaml:2:10: error: input 'case' has no value");
}

TEST_F(ExperimentFaults, InputsBySeedNeedSeeds) {
  for (const std::string line : {"draw: {x: [0, 1]}", "seed_input: [x]"})
    expect_fault(kHead + "cases:\n  folders: [cases/*]\n  " + line + "\n" + kAfterCases, 5,
                 "'" + line.substr(0, line.find(':')) + "' without 'seeds'",
                 "inputs of a simulation that differ between cases stand in 'simulate'");
}

TEST_F(ExperimentFaults, SimulationAndSeeds) {
  expect_fault(kHead + "cases:\n  simulate: s.yaml\n" + kAfterCases, 4, "'simulate' must be a map, got 's.yaml'",
               kMapHint);
  expect_fault(kHead + "cases:\n  simulate: {seeds: 1..2}\n" + kAfterCases, 4, "'simulate' does not name its pipeline",
               "add  pipeline: ../simulate/simulate.yaml");
  expect_fault(kHead + "cases:\n  simulate: {pipeline: s.yaml}\n" + kAfterCases, 4,
               "'simulate' does not say which seeds", "add  seeds: 1..20  or a list");
  expect_simulation_fault("pipelin: s.yaml", "unknown key 'pipelin' in 'simulate'", "did you mean 'pipeline'?");
  expect_simulation_fault("pipeline: q.yaml", "there is no file 'q.yaml'", kStartsHere);
  expect_simulation_fault("output: csae", "the pipeline s has no output 'csae'", "did you mean 'case'?");
  expect_simulation_fault("output: [case]", "output: expected a text, got a list of 1");
  expect_simulation_fault("set: {c.wrod: two}", "'test.constant' has no option 'wrod'", "did you mean 'word'?");
  expect_simulation_fault("inputs: {y: 1}", "the pipeline has no input 'y'", "did you mean 'x'?");
  expect_simulation_fault("draw: [x]", "'draw' must be a map, got a list of 1", kMapHint);
  expect_simulation_fault("draw: {y: [0, 1]}", "the pipeline has no input 'y'", "did you mean 'x'?");
  expect_simulation_fault("draw: {x: 1}", "'x' must be the two ends of a range", "write it as  x: [-10, 10]");
  expect_simulation_fault("draw: {x: [1, 2, 3]}", "'x' must be the two ends of a range", "write it as  x: [-10, 10]");
  expect_simulation_fault("draw: {x: [0, far]}", "x: expected a number, got 'far'");
  expect_simulation_fault("draw: {x: [3, 1]}", "the range of 'x' ends before it begins");
  expect_simulation_fault("seed_input: shape", "'seed_input' must be a list", "write it as  seed_input: [a, b]");
  expect_simulation_fault("seed_input: [shpae]", "the pipeline has no input 'shpae'", "did you mean 'shape'?");
  const std::string ranges = "'seeds' must be a range such as 1..20, of at most 100000, or a list of integers";
  for (const char* wrong : {"5..1", "-1..3", "1..200000", "1..", "many", "7", "[]", "{}"})
    expect_simulation_fault(std::string("seeds: ") + wrong, ranges);
  expect_simulation_fault("seeds: [1, two]", "a seed: expected an integer, got 'two'");
  expect_simulation_fault("seeds: [1, -2]", "a seed must be 0 or more, got -2");
  expect_fault(kHead + "cases:\n  simulate: {pipeline: s.yaml, seeds: [4, 4]}\n" + kAfterCases, 4,
               "two cases are named 'seed-4'", "give each seed once");
}

TEST_F(ExperimentFaults, Starts) {
  expect_fault_of("starts: 5", "'starts' must be a map, got '5'", kMapHint);
  expect_fault_of("starts: {nodes: s, node: s, count: 3}", "unknown key 'nodes' in 'starts'", "did you mean 'node'?");
  expect_fault_of("starts: {count: 3}", "'starts' does not say which node is displaced", "add  node: start");
  expect_fault_of("starts: {node: s}", "'starts' does not say how many", "add  count: 20");
  expect_fault_of("starts: {node: s, count: 0}", "'count' must be 1 to 100000, got 0");
  expect_fault_of("starts: {node: s, count: some}", "count: expected an integer, got 'some'");
  expect_fault_of("starts: {node: s, count: 3, seed: -1}", "'seed' must be 0 to 4611686018427387904, got -1");
  expect_fault_of("starts: {node: s, count: 3, rotation_deg: 200}", "'rotation_deg' must be 0 to 180, got 200");
  expect_fault_of("starts: {node: s, count: 3, translation_mm: -1}", "'translation_mm' must be 0 to 1000, got -1");
  expect_fault_of("starts: {node: s, count: 3, translation_mm: far}", "translation_mm: expected a number, got 'far'");
  expect_fault_of("starts: {node: [s], count: 3}", "node: expected a text, got a list of 1");
  expect_fault_of("starts: {node: s, count: 3}", "the pipeline has no node 's'", "did you mean 'c'?");
}
TEST_F(ExperimentFaults, StartsOfANodeThatCannotBeDisplaced) {
  read(kGood + "starts: {node: c, count: 3}\n");
  ASSERT_EQ(diagnostics.size(), 2u) << diagnostics.text();
  for (const char* option : {"rotation_deg", "translation_mm"})
    EXPECT_HAS(diagnostics.text(), "e.yaml:8:1: error: 'test.constant' has no option '" + std::string(option) + "'");
}

TEST_F(ExperimentFaults, Metrics) {
  const auto metrics = [](const std::string& text) { return kStart + kVariants + "metrics: " + text + "\n"; };
  const std::string as_list = "write it as  metrics: [errors.distal.final.mtre_mm]";
  expect_fault(metrics("number.value"), 7, "'metrics' must be a list", as_list);
  expect_fault(metrics("[]"), 7, "'metrics' names no figure", as_list);
  expect_fault(metrics("\n- [a]"), 8, "an item of 'metrics': expected a text, got a list of 1");
  expect_fault(metrics("\n- number.value\n- number.value"), 9, "'number.value' is given twice in 'metrics'");
  expect_fault(metrics("\n- {label: Sum}"), 8, "a metric does not say which figure",
               "write it as  {figure: errors.distal.final.mtre_mm, label: mTRE}");
  expect_fault(metrics("\n- {figure: number.value, lable: Sum}"), 8, "unknown key 'lable' in a metric",
               "did you mean 'label'?");
  expect_fault(metrics("\n- {figure: number.value, better: highest}"), 8, "'highest' is no way to be better",
               "did you mean 'higher'?");
  expect_fault(metrics("\n- {figure: number.value, label: [Sum]}"), 8, "label: expected a text, got a list of 1");
  expect_fault(metrics("\n- {figure: [number.value]}"), 8, "figure: expected a text, got a list of 1");
  expect_fault(metrics("[nubmer.value]"), 7, "the pipeline p has no output 'nubmer'", "did you mean 'number'?");
  expect_fault(metrics("[truth.value]"), 7, "output 'truth' is truth, not figures of merit",
               "name an output of an evaluate node");
  expect_fault(metrics("[number]"), 7, "'number' does not say which figure", "write it as  number.FIGURE");
}

TEST_F(ExperimentFaults, SuccessBaselineAndPictures) {
  expect_fault_of("success: 2", "'success' must be a map, got '2'", kMapHint);
  expect_fault_of("success: {number.value: low}", "number.value: expected a number, got 'low'");
  expect_fault_of("success: {number.valeu: 1}", "'number.valeu' is not among the metrics",
                  "did you mean 'number.value'?");
  expect_fault_of("baseline: tow", "there is no variant 'tow'", "did you mean 'two'?");
  expect_fault_of("baseline: [two]", "baseline: expected a text, got a list of 1");
  expect_fault_of("initial_error: nubmer.value", "the pipeline p has no output 'nubmer'", "did you mean 'number'?");
  expect_fault_of("initial_error: truth.value", "output 'truth' is truth, not figures of merit",
                  "name an output of an evaluate node");
  expect_fault_of("initial_error: number", "'number' does not say which figure", "write it as  number.FIGURE");
  expect_fault_of("initial_error: []", "initial_error: expected a text, got a list of 0");
  expect_fault_of("pictures: number", "'pictures' must be a list", "write it as  pictures: [a, b]");
  expect_fault_of("pictures: [nubmer]", "the pipeline p has no output 'nubmer'", "did you mean 'number'?");
  expect_fault_of("pictures: [[number]]", "an item of 'pictures': expected a text, got a list of 1");
  expect_fault_of("timed_cells: -1", "'timed_cells' must be 0 to 1000, got -1");
  expect_fault_of("timed_cells: all", "timed_cells: expected an integer, got 'all'");
}

}  // namespace experiment_faults_test
