// SPDX-License-Identifier: Apache-2.0
#pragma once
// Pipelines that are read from several files.
#include <string>

#include "tests/framework/pipeline/pipeline_fixture.hpp"

namespace pipeline_fixture {

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
