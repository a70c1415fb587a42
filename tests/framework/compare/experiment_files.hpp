// SPDX-License-Identifier: Apache-2.0
#pragma once
// Experiment files in a folder of their own, with a pipeline and cases beside them.

#include "marrow/compare/experiment.hpp"
#include "tests/framework/fixture.hpp"

namespace experiment_files {

using runtime_fixture::Scratch;
using runtime_fixture::test_catalogue;

inline const std::string kPipeline =
    "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  c: {uses: test.constant, with: {path: $case, value: 1}}\n"
    "  n: {uses: test.add, in: {a: c, b: c}}\n  f: {uses: test.fail_above, in: {a: n}, with: {value: 9}}\n"
    "  t: {uses: test.truth}\noutputs: {number: n, other: f, truth: t}\n";
inline const std::string kSimulation =
    "marrow: 1\ninputs: {x: {type: number, default: 0}, shape: {type: integer, default: 1}}\nnodes:\n"
    "  c: {uses: test.constant, with: {value: $x, count: $shape}}\noutputs: {case: c}\n";
inline const std::string kHead = "experiment: 1\npipeline: p.yaml\n";
inline const std::string kCases = "cases: {folders: [cases/*]}\n";
inline const std::string kVariants = "variants:\n  one: {}\n  two: {c.value: 2}\n";
inline const std::string kMetrics = "metrics: [number.value]\n";
inline const std::string kStart = kHead + kCases;  // lines 1 to 3

/// The file p.yaml and the folders cases/a and cases/b; s.yaml makes cases.
class ExperimentFiles : public testing::Test {
 protected:
  explicit ExperimentFiles(const marrow::Catalogue& catalogue = test_catalogue()) : nodes(catalogue) {
    scratch.write("p.yaml", kPipeline);
    scratch.write("s.yaml", kSimulation);
    for (const char* name : {"b", "a"}) std::filesystem::create_directories(scratch.path / "cases" / name);
  }
  /// Adds the node s, whose start can be displaced.
  void add_displaced_node() const {
    std::string pipeline = kPipeline;
    pipeline.insert(pipeline.find("  t:"), "  s: {uses: test.displaced}\n");
    scratch.write("p.yaml", pipeline);
  }
  marrow::compare::Experiment read(const std::string& text, std::size_t more_cases = 0) {
    diagnostics = marrow::Diagnostics();
    return marrow::compare::read_experiment(scratch.write("e.yaml", text), nodes, diagnostics, more_cases);
  }
  /// read() of a text without a fault.
  marrow::compare::Experiment read_good(const std::string& text, std::size_t more_cases = 0) {
    const marrow::compare::Experiment experiment = read(text, more_cases);
    if (!diagnostics.empty()) throw std::runtime_error(text + diagnostics.text());
    return experiment;
  }
  /// The last reading gave exactly this fault.
  void expect_only_fault(int line, const std::string& message, const std::string& hint = "") const {
    ASSERT_EQ(diagnostics.size(), 1u) << diagnostics.text();
    const marrow::Diagnostic fault = diagnostics.sorted()[0];
    EXPECT_EQ(fault.place.line, line) << diagnostics.text();
    EXPECT_EQ(std::filesystem::path(fault.place.file).filename(), "e.yaml") << diagnostics.text();
    EXPECT_EQ(fault.message, message);
    EXPECT_EQ(fault.hint, hint);
  }
  void expect_fault(const std::string& text, int line, const std::string& message, const std::string& hint = "") {
    read(text);
    SCOPED_TRACE(text);
    expect_only_fault(line, message, hint);
  }
  Scratch scratch;
  const marrow::Catalogue& nodes;
  marrow::Diagnostics diagnostics;
};

}  // namespace experiment_files
