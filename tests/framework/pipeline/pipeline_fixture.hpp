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
    return marrow::read_pipeline(scratch.write("p.yaml", text), arguments, test_catalogue(), diagnostics);
  }
  /// The pipeline must have one fault, at this place. Its message and hint contain these texts.
  void expect_fault(const std::string& text, int line, int column, const std::string& message,
                    const std::string& hint = "", const marrow::PipelineArguments& arguments = {}) {
    read(text, arguments);
    ASSERT_EQ(diagnostics.size(), 1u) << text << diagnostics.text();
    const marrow::Diagnostic fault = diagnostics.sorted()[0];
    EXPECT_EQ(fault.place.line, line) << diagnostics.text();
    EXPECT_EQ(fault.place.column, column) << diagnostics.text();
    EXPECT_NE(fault.message.find(message), std::string::npos) << diagnostics.text();
    EXPECT_NE(fault.hint.find(hint), std::string::npos) << diagnostics.text();
  }
  /// The last text that was read must have one fault. It is shown with this text.
  void expect_one_fault(const std::string& shown) {
    EXPECT_EQ(diagnostics.size(), 1u) << diagnostics.text();
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
