// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "catalogue_text.hpp"
#include "commands.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

std::map<std::string, std::string> options_of(const PipelineNode& node) {
  std::map<std::string, std::string> options;
  for (std::size_t i = 0; i < node.options.size(); ++i) options[node.info.options[i].name] = yaml_text(node.options[i]);
  return options;
}

/// Options whose values are not the defaults.
json given_options(const PipelineNode& node) {
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
    text += node.info.inputs[std::size_t(wire.port)].name + ":";
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
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    const PipelineNode& node = pipeline.nodes[i];
    if (!needed[i]) continue;
    json differs = json::object();
    for (const auto& [name, other] : variants)
      for (const PipelineNode& same : other.nodes)
        if (same.id == node.id) {
          const std::string text = difference(node, same);
          if (!text.empty()) differs[name] = text;
        }
    nodes.push_back(
        {{"id", node.id}, {"uses", node.info.name}, {"options", given_options(node)}, {"differs", differs}});
    for (const Wire& wire : node.wires)
      for (const Reference& source : wire.sources)
        edges.push_back({{"from", pipeline.nodes[std::size_t(source.node)].id},
                         {"to", node.id},
                         {"port", node.info.inputs[std::size_t(wire.port)].name}});
  }
  return {{"nodes", nodes}, {"edges", edges}};
}

}  // namespace marrow::cli
