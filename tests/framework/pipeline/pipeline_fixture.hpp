// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tests of pipeline files share: reading a text, and the one fault that it must have.
#include <string>

#include "tests/framework/fixture.hpp"

namespace pipeline_fixture {

using runtime_fixture::Scratch;
using runtime_fixture::test_catalogue;

class PipelineTest : public testing::Test {
 protected:
  marrow::Pipeline read(const std::string& text, const marrow::PipelineArguments& arguments = {}) {
    diagnostics = marrow::Diagnostics();
    return marrow::read_pipeline(scratch.write("p.yaml", text), arguments, catalogue(), diagnostics);
  }
  /// read() of a text without a fault.
  marrow::Pipeline read_good(const std::string& text, const marrow::PipelineArguments& arguments = {}) {
    const marrow::Pipeline pipeline = read(text, arguments);
    if (!diagnostics.empty()) throw std::runtime_error(text + diagnostics.text());
    return pipeline;
  }
  virtual const marrow::Catalogue& catalogue() const { return test_catalogue(); }
  /// The fault of the last text that was read. There must be only one.
  marrow::Diagnostic only_fault() const {
    EXPECT_EQ(diagnostics.size(), 1u) << diagnostics.text();
    return diagnostics.empty() ? marrow::Diagnostic() : diagnostics.sorted()[0];
  }
  /// The pipeline must have one fault, at this place. Its message and hint contain these texts.
  void expect_fault(const std::string& text, int line, int column, const std::string& message,
                    const std::string& hint = "", const marrow::PipelineArguments& arguments = {}) {
    read(text, arguments);
    const marrow::Diagnostic fault = only_fault();
    EXPECT_EQ(fault.place.line, line) << diagnostics.text();
    EXPECT_EQ(fault.place.column, column) << diagnostics.text();
    EXPECT_NE(fault.message.find(message), std::string::npos) << diagnostics.text();
    EXPECT_NE(fault.hint.find(hint), std::string::npos) << diagnostics.text();
  }
  /// The last text that was read must have one fault. It is shown with this text.
  void expect_shown(const std::string& shown) const {
    only_fault();
    EXPECT_NE(diagnostics.text().find(shown), std::string::npos) << diagnostics.text();
  }
  /// The node 'n', in line 5 of a pipeline with the nodes 'c' and 's', must have this fault.
  void expect_node_fault(const std::string& node, int column, const std::string& message,
                         const std::string& hint = "") {
    expect_fault(
        "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  s: {uses: test.sides}\n  n: " + node + "\noutputs: {o: c}\n",
        5, column, message, hint);
  }
  Scratch scratch;
  marrow::Diagnostics diagnostics;
};

}  // namespace pipeline_fixture
