// SPDX-License-Identifier: Apache-2.0
#include "catalogue_text.hpp"
#include "commands.hpp"
#include "drawn_graph.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

/// How a body runs, as options of the node.
std::map<std::string, std::string> options_of_repetition(const Repetition& repetition) {
  std::map<std::string, std::string> options{{"passes", passes_text(repetition)},
                                             {"if_pass_fails", repetition.goes_on ? "go_on" : "end"}};
  for (const Repetition::Given& given : repetition.given)
    if (given.carried >= 0) options["carry " + given.name] = repetition.alone.outputs[std::size_t(given.carried)].name;
  return options;
}

std::map<std::string, std::string> options_of(const PipelineNode& node) {
  if (node.repetition) return options_of_repetition(*node.repetition);
  std::map<std::string, std::string> options;
  for (std::size_t i = 0; i < node.options.size(); ++i) options[node.info.options[i].name] = yaml_text(node.options[i]);
  return options;
}

/// Options whose values are not the defaults.
json given_options(const PipelineNode& node) {
  if (node.repetition) return options_of_repetition(*node.repetition);
  json given = json::object();
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    const OptionInfo& option = node.info.options[i];
    if (option.required || node.options[i] != option.default_value) given[option.name] = yaml_text(node.options[i]);
  }
  return given;
}

std::string wires_of(const PipelineNode& node) {
  std::string text;
  for (const Wire& wire : node.wires) {
    text += node.input_of(wire).name + ":";
    for (const Reference& source : wire.sources) text += " " + source.text;
    text += "\n";
  }
  return text;
}

/// The difference of two nodes, for example "uses KIND.NAME; high = 80". Empty if they are the same.
std::string difference(const PipelineNode& base, const PipelineNode& other) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  if (base.info.name != other.info.name) add("uses " + other.info.name);
  const auto before = options_of(base);
  for (const auto& [name, value] : options_of(other)) {
    const auto found = before.find(name);
    if (found == before.end() ? base.info.name == other.info.name : found->second != value) add(name + " = " + value);
  }
  if (wires_of(base) != wires_of(other)) add("other inputs");
  if (base.may_fail != other.may_fail) add(other.may_fail ? "may fail" : "may not fail");
  return text;
}

}  // namespace

json graph_of(const Pipeline& pipeline, const std::vector<std::pair<std::string, Pipeline>>& variants) {
  json nodes = json::array(), edges = json::array();
  const DrawnGraph graph = drawn_graph(pipeline, true);
  std::vector<std::pair<std::string, DrawnGraph>> others;
  for (const auto& [name, other] : variants) others.emplace_back(name, drawn_graph(other, false));
  for (const auto& [id, body, node, is_needed] : graph.nodes) {
    json differs = json::object();
    for (const auto& [name, other] : others)
      for (const DrawnNode& same : other.nodes)
        if (same.id == id) {
          const std::string text = difference(*node, *same.node);
          if (!text.empty()) differs[name] = text;
        }
    nodes.push_back({{"id", id}, {"uses", node->info.name}, {"options", given_options(*node)}, {"differs", differs}});
  }
  for (const DrawnEdge& edge : graph.edges)
    if (!edge.is_of_pass_before) edges.push_back({{"from", edge.from}, {"to", edge.to}, {"port", edge.port}});
  return {{"nodes", nodes}, {"edges", edges}};
}

}  // namespace marrow::cli
