// SPDX-License-Identifier: Apache-2.0
#pragma once
// What tests of runs share: a pipeline, given as the text of its nodes and outputs, how it runs, and what came of it.
#include "tests/framework/fixture.hpp"

namespace run_fixture {

class RunTest : public testing::Test {
 protected:
  /// The nodes that pipelines may use. The libraries of a few folders of the tests.
  virtual const marrow::Catalogue& catalogue() const { return runtime_fixture::test_catalogue(); }

  void read(const std::string& nodes, const std::string& outputs) {
    marrow::Diagnostics diagnostics;
    pipeline =
        marrow::read_pipeline(scratch.write("p.yaml", "marrow: 1\nnodes:\n" + nodes + "outputs: {" + outputs + "}\n"),
                              {}, catalogue(), diagnostics);
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
  }
  marrow::RunResult run(const std::string& nodes, const std::string& outputs) {
    read(nodes, outputs);
    return run();
  }
  /// Runs what was read last.
  marrow::RunResult run() {
    settings.observer = [this](const marrow::RunEvent& event) {
      events.push_back(event);
      if (on_event) on_event(event);
    };
    return marrow::run_pipeline(pipeline, catalogue(), settings);
  }

  const marrow::NodeRecord& record(const marrow::RunResult& result, const std::string& id) const {
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
      if (pipeline.nodes[i].id == id) return result.nodes[i];
    throw marrow::Error("there is no node " + id);
  }
  marrow::Value output(const marrow::RunResult& result, std::size_t index = 0) const {
    return marrow::value_of(result, pipeline.outputs[index].source);
  }
  static double number_of(const marrow::Value& metrics, std::size_t item = 0) {
    return metrics.as<marrow::Metrics>().items.at(item).value;
  }
  double result_of(const marrow::RunResult& result, std::size_t index = 0) const {
    return number_of(output(result, index));
  }
  /// Whether an event of this kind says this.
  bool was_said(marrow::RunEvent::Kind kind, const std::string& text) const {
    for (const marrow::RunEvent& event : events)
      if (event.kind == kind && event.text == text) return true;
    return false;
  }
  std::string event_text(marrow::RunEvent::Kind kind) const {
    for (const marrow::RunEvent& event : events)
      if (event.kind == kind) return event.text;
    return "";
  }

  runtime_fixture::Scratch scratch;
  marrow::Pipeline pipeline;
  marrow::RunSettings settings = two_threads();
  std::vector<marrow::RunEvent> events;
  std::function<void(const marrow::RunEvent&)> on_event;

 private:
  static marrow::RunSettings two_threads() {
    marrow::RunSettings settings;
    settings.threads = 2;
    return settings;
  }
};

}  // namespace run_fixture
