// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <nlohmann/json.hpp>

#include "command_options.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

/// A text between the quotes of a DOT file.
std::string dot_text(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

/// Where a node is written if that is another file than the pipeline's own.
std::string origin_of(const PipelineNode& node, const Pipeline& pipeline) {
  if (node.place.file == pipeline.file.string()) return "";
  return "  [" + printable(node.place.file) + formatted(":{}]", node.place.line);
}

/// The nodes with their wires; a body further to the right.
void print_nodes(const Pipeline& pipeline, const std::string& margin) {
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    const PipelineNode& node = pipeline.nodes[i];
    std::printf("%s%s  (%s)%s%s%s%s\n", margin.c_str(), node.id.c_str(), node.info.name.c_str(),
                node.repetition            ? ("  " + passes_text(*node.repetition)).c_str()
                : node.mapped_axes.empty() ? ""
                                           : ("  for each " + joined(node.mapped_axes, " x ")).c_str(),
                node.may_fail ? "  [may fail]" : "", needed[i] ? "" : "  [not needed]",
                origin_of(node, pipeline).c_str());
    for (const Wire& wire : node.wires) {
      std::string sources;
      for (const Reference& source : wire.sources) sources += (sources.empty() ? "" : " + ") + source.text;
      std::printf("%s    %s <- %s\n", margin.c_str(), node.input_of(wire).name.c_str(), printable(sources).c_str());
    }
    if (!node.repetition) continue;
    for (const Repetition::Given& given : node.repetition->given)
      if (given.carried >= 0)
        std::printf("%s    %s <- %s of the pass before\n", margin.c_str(), given.name.c_str(),
                    node.repetition->alone.outputs[std::size_t(given.carried)].name.c_str());
    print_nodes(node.repetition->alone, margin + "    | ");
  }
}

void print_text(const Pipeline& pipeline) {
  print_nodes(pipeline, "");
  std::printf("outputs\n");
  for (const PipelineOutput& output : pipeline.outputs) {
    const std::vector<std::string> axes = pipeline.axes_of(output.source);
    std::printf("    %s <- %s%s\n", output.name.c_str(), printable(output.source.text).c_str(),
                axes.empty() ? "" : ("  (a list over " + joined(axes, " x ") + ")").c_str());
  }
}

/// The nodes of one body, each with its own body in a frame. `body` is empty for the whole pipeline.
void print_dot_nodes(const DrawnGraph& graph, const std::string& body, const std::string& margin) {
  for (const DrawnNode& drawn : graph.nodes) {
    if (drawn.body != body) continue;
    const PipelineNode& node = *drawn.node;
    const std::string axes = node.repetition            ? "\\n" + dot_text(passes_text(*node.repetition))
                             : node.mapped_axes.empty() ? ""
                                                        : "\\nfor each " + joined(node.mapped_axes, " x ");
    const std::string id = dot_text(drawn.id);
    std::printf("%s\"%s\" [label=\"%s\\n%s%s%s\", tooltip=\"%s:%d\"];\n", margin.c_str(), id.c_str(),
                dot_text(node.id).c_str(), dot_text(node.info.name).c_str(), axes.c_str(),
                node.may_fail ? "\\nmay fail" : "", dot_text(node.place.file).c_str(), node.place.line);
    if (!node.repetition) continue;
    std::printf("%ssubgraph \"cluster %s\" {\n%s  style=rounded; color=gray70;\n", margin.c_str(), id.c_str(),
                margin.c_str());
    print_dot_nodes(graph, drawn.id, margin + "  ");
    std::printf("%s}\n", margin.c_str());
  }
}

void print_dot(const Pipeline& pipeline) {
  std::printf("digraph \"%s\" {\n  rankdir=LR; node [shape=box, style=rounded, fontname=\"sans-serif\"];\n",
              dot_text(pipeline.name).c_str());
  const DrawnGraph graph = drawn_graph(pipeline, false);
  print_dot_nodes(graph, "", "  ");
  // Dashed edges carry functions, solid edges carry data. What is handed to the next pass does not rank nodes.
  for (const DrawnEdge& edge : graph.edges)
    std::printf("  \"%s\" -> \"%s\" [label=\"%s\"%s%s];\n", dot_text(edge.from).c_str(), dot_text(edge.to).c_str(),
                dot_text(edge.port).c_str(), edge.is_function ? ", style=dashed" : "",
                edge.is_of_pass_before ? ", constraint=false, color=gray50" : "");
  for (const PipelineOutput& output : pipeline.outputs) {
    const PipelineNode& from = pipeline.node_of(output.source);
    const bool is_function = pipeline.output_of(output.source).type.is_function;
    std::printf("  \"output %s\" [label=\"%s\", shape=ellipse];\n", dot_text(output.name).c_str(),
                dot_text(output.name).c_str());
    std::printf("  \"%s\" -> \"output %s\" [label=\"\"%s];\n", dot_text(from.id).c_str(), dot_text(output.name).c_str(),
                is_function ? ", style=dashed" : "");
  }
  std::printf("}\n");
}

nlohmann::json json_of(const Pipeline& pipeline) {
  using nlohmann::json;
  json nodes = json::array(), edges = json::array(), outputs = json::array();
  const DrawnGraph graph = drawn_graph(pipeline, false);
  for (const DrawnNode& drawn : graph.nodes) {
    const PipelineNode& node = *drawn.node;
    nodes.push_back({{"id", drawn.id},
                     {"uses", node.info.name},
                     {"body_of", drawn.body},
                     {"for_each", node.mapped_axes},
                     {"passes", node.repetition ? passes_text(*node.repetition) : ""},
                     {"may_fail", node.may_fail},
                     {"needed", drawn.is_needed}});
  }
  for (const DrawnEdge& edge : graph.edges)
    edges.push_back({{"from", edge.from},
                     {"to", edge.to},
                     {"port", edge.port},
                     {"function", edge.is_function},
                     {"of_pass_before", edge.is_of_pass_before}});
  for (const PipelineOutput& output : pipeline.outputs)
    outputs.push_back({{"name", output.name},
                       {"from", pipeline.node_of(output.source).id},
                       {"reference", output.source.text},
                       {"type", pipeline.output_of(output.source).type.id},
                       {"axes", pipeline.axes_of(output.source)}});
  return {{"name", pipeline.name}, {"nodes", nodes}, {"edges", edges}, {"outputs", outputs}};
}

struct GraphRequest {
  PipelineRequest pipeline;
  bool as_dot = false, as_json = false;
};

int graph(const GraphRequest& request) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load(request.pipeline, catalogue, pipeline, false)) return 2;
  if (request.as_json)
    print_as_json(json_of(pipeline));
  else if (request.as_dot)
    print_dot(pipeline);
  else
    print_text(pipeline);
  return 0;
}

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

void add_graph(CLI::App& app, int& code) {
  const auto request = std::make_shared<GraphRequest>();
  CLI::App* command =
      app.add_subcommand("graph", "show a pipeline's graph, with what is called for each view or fragment");
  add_pipeline_arguments(command, request->pipeline);
  CLI::Option* dot = command->add_flag("--dot", request->as_dot, "as a DOT file for Graphviz");
  command->add_flag("--json", request->as_json, "as JSON")->excludes(dot);
  command->callback([request, &code] { code = graph(*request); });
  say_that_libraries_are_described(command);
}

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
