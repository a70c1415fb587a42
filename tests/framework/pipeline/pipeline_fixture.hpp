// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tests of pipeline files share: reading a text, and the one fault that it must have.

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

class LayersTest : public PipelineTest {
 protected:
  /// Reads a pipeline that extends base.yaml.
  marrow::Pipeline extend(const std::string& base, const std::string& text,
                          const marrow::PipelineArguments& arguments = {}) {
    scratch.write("base.yaml", "marrow: 1\n" + base);
    return read("marrow: 1\nextends: base.yaml\n" + text, arguments);
  }
  marrow::Pipeline good(const marrow::Pipeline& pipeline) const {
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    return pipeline;
  }
  static const marrow::PipelineNode& node(const marrow::Pipeline& pipeline, const std::string& id) {
    for (const marrow::PipelineNode& one : pipeline.nodes)
      if (one.id == id) return one;
    throw std::runtime_error("no node " + id);
  }
  static marrow::OptionValue option(const marrow::Pipeline& pipeline, const std::string& id, const std::string& name) {
    const marrow::PipelineNode& one = node(pipeline, id);
    for (std::size_t i = 0; i < one.options.size(); ++i)
      if (one.info.options[i].name == name) return one.options[i];
    throw std::runtime_error("no option " + name);
  }
  static double number(const marrow::Pipeline& pipeline, const std::string& id, const std::string& name = "value") {
    return std::get<double>(option(pipeline, id, name));
  }
  /// "port <- source" of all wires of a node.
  static std::string wires(const marrow::Pipeline& pipeline, const std::string& id) {
    std::string text;
    for (const marrow::Wire& wire : node(pipeline, id).wires) {
      text += (text.empty() ? "" : ", ") + node(pipeline, id).input_of(wire).name + " <-";
      for (const marrow::Reference& source : wire.sources) text += " " + source.text;
    }
    return text;
  }
  static std::string ids(const marrow::Pipeline& pipeline) {
    std::string text;
    for (const marrow::PipelineNode& one : pipeline.nodes) text += (text.empty() ? "" : " ") + one.id;
    return text;
  }
  /// The only fault is in this file and line, and says this.
  void expect_fault_in(const std::string& file, int line, const std::string& message,
                       const std::string& hint = "") const {
    const marrow::Diagnostic fault = only_fault();
    EXPECT_EQ(std::filesystem::path(fault.place.file).filename(), file) << diagnostics.text();
    EXPECT_EQ(fault.place.line, line) << diagnostics.text();
    EXPECT_NE(fault.message.find(message), std::string::npos) << diagnostics.text();
    EXPECT_NE(fault.hint.find(hint), std::string::npos) << diagnostics.text();
  }
};

}  // namespace pipeline_fixture
