// SPDX-License-Identifier: Apache-2.0
#include "drawn_graph.hpp"

#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

class Drawing {
 public:
  explicit Drawing(bool only_needed) : only_needed_(only_needed) {}

  /// `around`: the node that runs this graph as its body, in the graph `outer`.
  void add(const Pipeline& pipeline, const std::vector<bool>& needed, const std::string& path = "",
           const Pipeline* outer = nullptr, const PipelineNode* around = nullptr) {
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
      if (only_needed_ && !needed[i]) continue;
      const PipelineNode& node = pipeline.nodes[i];
      const std::string id = path + node.id;
      drawn_.nodes.push_back({id, path.empty() ? "" : path.substr(0, path.size() - 1), &node, needed[i]});
      if (node.repetition) {
        add_body(pipeline, node, id);
        continue;
      }
      for (const Wire& wire : node.wires)
        for (const Reference& source : wire.sources)
          add_edges(pipeline, source, path, outer, around, id, node.input_of(wire).name);
    }
  }

  DrawnGraph result() { return std::move(drawn_); }

 private:
  void add_body(const Pipeline& pipeline, const PipelineNode& node, const std::string& id) {
    const Repetition& repetition = *node.repetition;
    const std::vector<bool> of_first =
        repetition.first.needed([&](const std::string& name) { return repetition.is_given(name); });
    const std::size_t count = repetition.alone.nodes.size();
    add(repetition.alone, {of_first.end() - std::ptrdiff_t(count), of_first.end()}, id + "/", &pipeline, &node);
    for (const PipelineOutput& output : repetition.alone.outputs)
      add_edges(repetition.alone, output.source, id + "/", &pipeline, &node, id, output.name);
  }

  void add_edges(const Pipeline& pipeline, const Reference& source, const std::string& path, const Pipeline* outer,
                 const PipelineNode* around, const std::string& to, const std::string& port) {
    const PipelineNode& from = pipeline.node_of(source);
    const bool is_function = pipeline.output_of(source).type.is_function;
    const auto add_edge = [&](const std::string& id, bool is_of_pass_before) {
      drawn_.edges.push_back({id, to, port, is_function, is_of_pass_before});
    };
    bool is_made_in_body = true;
    const std::string outer_path = path.substr(0, path.empty() ? 0 : path.find_last_of('/', path.size() - 2) + 1);
    for (std::size_t i = 0; around && i < around->repetition->given.size(); ++i) {
      const Repetition::Given& given = around->repetition->given[i];
      if (!given.target.has_same_output(source)) continue;
      for (const Wire& wire : around->wires)
        if (std::size_t(wire.port) == i) {
          is_made_in_body = false;
          for (const Reference& one : wire.sources) add_edge(outer_path + outer->node_of(one).id, false);
        }
      if (given.carried < 0) continue;
      const Reference& carried = pipeline.outputs[std::size_t(given.carried)].source;
      add_edge(path + pipeline.node_of(carried).id, true);
    }
    if (is_made_in_body) add_edge(path + from.id, false);
  }

  bool only_needed_;
  DrawnGraph drawn_;
};

}  // namespace

DrawnGraph drawn_graph(const Pipeline& pipeline, bool only_needed) {
  Drawing drawing(only_needed);
  drawing.add(pipeline, pipeline.needed());
  return drawing.result();
}

std::string passes_text(const Repetition& repetition) {
  std::string text = repetition.is_loop ? "" : "each " + repetition.axis + " in turn";
  if (repetition.at_most)
    text += formatted("{}{}", text.empty() ? "at most " : ", at most ", counted(repetition.at_most, "pass", "passes"));
  if (repetition.until >= 0)
    text += ", until '" + repetition.alone.outputs[std::size_t(repetition.until)].name + "' says stop";
  return text;
}

}  // namespace marrow::cli
