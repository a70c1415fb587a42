// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "command_options.hpp"
#include "commands.hpp"
#include "marrow/domain/printable.hpp"

namespace marrow::cli {
namespace {

std::string axes_text(const std::vector<std::string>& axes) {
  std::string text;
  for (const std::string& axis : axes) text += (text.empty() ? "" : " x ") + axis;
  return text;
}

/// A text between the quotes of a DOT file.
std::string dot_text(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

void print_text(const Pipeline& pipeline) {
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    const PipelineNode& node = pipeline.nodes[i];
    std::printf("%s  (%s)%s%s%s\n", node.id.c_str(), node.info.name.c_str(),
                node.mapped_axes.empty() ? "" : ("  for each " + axes_text(node.mapped_axes)).c_str(),
                node.may_fail ? "  [may fail]" : "", needed[i] ? "" : "  [not needed]");
    for (const Wire& wire : node.wires) {
      std::string sources;
      for (const Reference& source : wire.sources) sources += (sources.empty() ? "" : " + ") + source.text;
      std::printf("    %s <- %s\n", node.info.inputs[std::size_t(wire.port)].name.c_str(), printable(sources).c_str());
    }
  }
  std::printf("outputs\n");
  for (const PipelineOutput& output : pipeline.outputs) {
    const std::vector<std::string> axes = pipeline.axes_of(output.source);
    std::printf("    %s <- %s%s\n", output.name.c_str(), printable(output.source.text).c_str(),
                axes.empty() ? "" : ("  (a list over " + axes_text(axes) + ")").c_str());
  }
}

void print_dot(const Pipeline& pipeline) {
  std::printf("digraph \"%s\" {\n  rankdir=LR; node [shape=box, style=rounded, fontname=\"sans-serif\"];\n",
              dot_text(pipeline.name).c_str());
  for (const PipelineNode& node : pipeline.nodes) {
    const std::string axes = node.mapped_axes.empty() ? "" : "\\nfor each " + axes_text(node.mapped_axes);
    const std::string id = dot_text(node.id);
    std::printf("  \"%s\" [label=\"%s\\n%s%s%s\"];\n", id.c_str(), id.c_str(), dot_text(node.info.name).c_str(),
                axes.c_str(), node.may_fail ? "\\nmay fail" : "");
  }
  const auto edge = [&](const Reference& source, const std::string& target, const std::string& port) {
    const PipelineNode& from = pipeline.nodes[std::size_t(source.node)];
    const PortInfo& output = from.info.outputs[std::size_t(source.output)];
    // Dashed edges carry functions, solid edges carry data.
    std::printf("  \"%s\" -> \"%s\" [label=\"%s\"%s];\n", dot_text(from.id).c_str(), dot_text(target).c_str(),
                dot_text(port).c_str(), output.type.is_function ? ", style=dashed" : "");
  };
  for (const PipelineNode& node : pipeline.nodes)
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources) edge(source, node.id, node.info.inputs[std::size_t(wire.port)].name);
  for (const PipelineOutput& output : pipeline.outputs) {
    std::printf("  \"output %s\" [label=\"%s\", shape=ellipse];\n", dot_text(output.name).c_str(),
                dot_text(output.name).c_str());
    edge(output.source, "output " + output.name, "");
  }
  std::printf("}\n");
}

int graph(const PipelineRequest& request, bool dot) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load(request, catalogue, pipeline, false)) return 2;
  if (dot)
    print_dot(pipeline);
  else
    print_text(pipeline);
  return 0;
}

}  // namespace

void add_graph(CLI::App& app, int& code) {
  const auto request = std::make_shared<PipelineRequest>();
  const auto dot = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("graph", "show a pipeline's graph, with what is called for each view or fragment");
  add_pipeline_arguments(command, *request);
  command->add_flag("--dot", *dot, "as a DOT file for Graphviz");
  command->callback([request, dot, &code] { code = graph(*request, *dot); });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
