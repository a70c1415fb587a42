// SPDX-License-Identifier: Apache-2.0
// Faults of experiments that would mix things up or have no effect: options and inputs that two sections set, one
// folder under two names, and variants with the names of tuned points.
#include "experiment_files.hpp"

namespace experiment_replaced_test {

using namespace experiment_files;

class ExperimentReplaced : public ExperimentFiles {
 protected:
  void expect_fault(const std::string& text, int line, const std::string& message,
                    const std::string& hint = "leave one of them out") {
    ExperimentFiles::expect_fault(text, line, message, hint);
  }
  void expect_none(const std::string& text) {
    read(text);
    EXPECT_TRUE(diagnostics.empty()) << text << diagnostics.text();
  }
};

std::string replaced(const std::string& what, const std::string& by, int line) {
  return what + " and by " + by + " in line " + std::to_string(line) + ", whose values would replace this one";
}

TEST_F(ExperimentReplaced, OptionsOfAVariant) {
  const std::string variants = kStart + "variants:\n  one: {}\n  two: {c.value: 2}\n" + kMetrics;  // lines 4 to 7
  const std::string what = "the option 'c.value' is set by variant 'two'";
  expect_fault(variants + "matrix: {c.value: [3, 4]}\n", 6, replaced(what, "'matrix'", 8));
  expect_fault(variants + "sweep: {options: {c.value: [3, 4]}, grid: 2}\n", 6, replaced(what, "'sweep'", 8));
  expect_none(variants + "matrix: {c.count: [3, 4]}\n");
  expect_none(variants + "set: {c.value: 5}\n");  // a variant is there to change what 'set' says
}

TEST_F(ExperimentReplaced, OptionsOfTheDisplacedNode) {
  const std::string starts = "starts: {node: start, count: 2, rotation_deg: 3}\n";  // line 4
  const std::string end = kMetrics;
  expect_fault(kStart + starts + "variants: {far: {start.translation_mm: [9, 0, 0]}}\n" + end, 5,
               replaced("the option 'start.translation_mm' is set by variant 'far'", "'starts'", 4));
  expect_fault(kStart + starts + "set: {start.rotation_deg: [9, 0, 0]}\n" + kVariants + end, 5,
               replaced("the option 'start.rotation_deg' is set by 'set'", "'starts'", 4));
  expect_fault(kStart + starts + "matrix: {start.rotation_deg: [[1, 0, 0], [2, 0, 0]]}\n" + end, 5,
               replaced("the option 'start.rotation_deg' is set by 'matrix'", "'starts'", 4));
  read(kStart + starts + "set: {start.distance_mm: 4}\n" + kVariants + end);  // these starts have no distance
  EXPECT_EQ(diagnostics.text().find("'starts'"), std::string::npos) << diagnostics.text();
}

TEST_F(ExperimentReplaced, TheMatrixByTheSweep) {
  expect_fault(kStart + "matrix: {c.value: [3, 4]}\nsweep: {options: {c.value: [3, 4]}, grid: 2}\n" + kMetrics, 4,
               replaced("the option 'c.value' is set by 'matrix'", "'sweep'", 5));
}

TEST_F(ExperimentReplaced, OptionsThatAreTuned) {
  const std::string variants = kStart + "variants:\n  one: {}\n  two: {c.value: 2}\n" + kMetrics;  // lines 4 to 7
  const std::string tune =
      "tune: {options: {c.value: [3, 4]}, optimizer: {uses: test.none}, points: 9, training_cases: 1, failed_as: 9";
  expect_fault(variants + tune + ", variant: two}\n", 6,
               replaced("the option 'c.value' is set by variant 'two'", "'tune'", 8));
  read(variants + tune + "}\n");  // the other variant, which is not tuned, may have a value of its own
  EXPECT_EQ(diagnostics.text().find("'c.value' is set by"), std::string::npos) << diagnostics.text();
  expect_fault(variants + "starts: {node: c, count: 2, distance_mm: 3}\ntune: {options: {c.distance_mm: [3, 4]}, " +
                   tune.substr(tune.find("optimizer")) + "}\n",
               9, replaced("the option 'c.distance_mm' is set by 'tune'", "'starts'", 8));
}

TEST_F(ExperimentReplaced, AVariantThatIsNamedAsATunedPoint) {
  const std::string tune =
      "tune: {options: {c.value: [3, 4]}, optimizer: {uses: test.none}, points: 9, training_cases: 1, failed_as: 9}\n";
  const auto fault = [](const std::string& name) {
    return "variant '" + name + "' is named as the points of 'tune' are, so its runs would count as theirs";
  };
  for (const char* name : {"tuned+3.5", "Tuned+4"})
    expect_fault(kStart + "variants:\n  one: {}\n  " + name + ": {c.count: 2}\n" + kMetrics + tune, 6, fault(name),
                 "rename it");
  expect_fault(kStart + "variants: {tuned: {}}\nmatrix: {c.count: [3]}\n" + kMetrics + tune, 4, fault("tuned+3"),
               "rename it");
  expect_none(kStart + "variants: {tuned+3.5: {}}\n" + kMetrics);
}

TEST_F(ExperimentReplaced, InputsThatAreDrawn) {
  const std::string simulate = kHead + "cases:\n  simulate:\n    pipeline: s.yaml\n    seeds: 1..2\n";
  const std::string end = kVariants + kMetrics;
  expect_fault(simulate + "    inputs: {x: 4}\n    draw: {x: [0, 1]}\n" + end, 7,
               replaced("the input 'x' is set by 'inputs'", "'draw'", 8));
  expect_fault(simulate + "    inputs: {shape: 4}\n    seed_input: [shape]\n" + end, 7,
               replaced("the input 'shape' is set by 'inputs'", "'seed_input'", 8));
  expect_fault(simulate + "    draw: {shape: [1, 2]}\n    seed_input: [shape]\n" + end, 7,
               replaced("the input 'shape' is set by 'draw'", "'seed_input'", 8));
  expect_fault(kStart + "inputs: {case: elsewhere}\n" + end, 4,
               replaced("the input 'case' is set by 'inputs'", "'cases'", 3));
  expect_fault(kHead + "cases: {seeds: 1..2, draw: {case: [0, 1]}}\ninputs: {case: 4}\n" + end, 4,
               replaced("the input 'case' is set by 'inputs'", "'draw'", 3));
}

TEST_F(ExperimentReplaced, OneFolderUnderTwoNames) {
  std::filesystem::create_directory_symlink("a", scratch.path / "cases" / "c");
  const std::string folder = (scratch.path / "cases").string();
  expect_fault(kStart + kVariants + kMetrics, 3,
               "the cases 'a' and 'c' are one folder, " + folder + "/a, to which " + folder + "/c leads",
               "leave one of them out, or its runs count twice");
  std::filesystem::remove(scratch.path / "cases" / "c");
  expect_none(kStart + kVariants + kMetrics);
}

TEST_F(ExperimentReplaced, OneSeedTwice) {
  expect_fault(kHead + "cases: {simulate: {pipeline: s.yaml, seeds: [1, 2, 1]}}\n" + kVariants + kMetrics, 3,
               "two cases are named 'seed-1'", "give each seed once");
}

}  // namespace experiment_replaced_test
