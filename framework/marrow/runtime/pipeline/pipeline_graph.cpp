// SPDX-License-Identifier: Apache-2.0
// Queries about a checked pipeline, and its YAML.
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {
namespace {

/// An item of an option, as written in YAML. A dollar in a text is doubled, so that it does not begin the name of an
/// input.
template <class T>
T written(const T& item) {
  return item;
}
std::string written(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '$' ? "$$" : std::string(1, c);
  return result;
}

/// The outputs of a body come twice: as the list over all passes, and as that of the last pass.
std::vector<std::string> axes_of_passes(const PipelineNode& node, const Reference& source) {
  const Repetition& repetition = *node.repetition;
  std::vector<std::string> axes =
      repetition.body.axes_of(repetition.body.outputs[std::size_t(source.output / 2)].source);
  if (source.output % 2 == 0) axes.insert(axes.begin(), repetition.axis);
  axes.erase(axes.begin(), axes.begin() + std::ptrdiff_t(std::min(axes.size(), source.items.size())));
  return axes;
}

void write_options(YAML::Emitter& out, const PipelineNode& node) {
  out << YAML::Key << "with" << YAML::Value << YAML::BeginMap;
  for (std::size_t i = 0; i < node.options.size(); ++i) {
    out << YAML::Key << node.info.options[i].name << YAML::Value;
    std::visit(
        [&](const auto& value) {
          if constexpr (requires { value.begin(); } && !std::is_same_v<std::decay_t<decltype(value)>, std::string>) {
            out << YAML::Flow << YAML::BeginSeq;
            for (const auto& item : value) out << written(item);
            out << YAML::EndSeq;
          } else {
            out << written(value);
          }
        },
        node.options[i]);
  }
  out << YAML::EndMap;
}

void write_graph(YAML::Emitter& out, const Pipeline& pipeline);

void write_repetition(YAML::Emitter& out, const Repetition& repetition) {
  if (!repetition.is_loop) out << YAML::Key << "over" << YAML::Value << repetition.axis;
  if (repetition.at_most) out << YAML::Key << "at_most" << YAML::Value << repetition.at_most;
  if (repetition.until >= 0)
    out << YAML::Key << "until" << YAML::Value << repetition.alone.outputs[std::size_t(repetition.until)].name;
  if (repetition.goes_on) out << YAML::Key << "if_pass_fails" << YAML::Value << "go_on";
  out << YAML::Key << "carry" << YAML::Value << YAML::Flow << YAML::BeginMap;
  for (const Repetition::Given& given : repetition.given)
    if (given.carried >= 0)
      out << YAML::Key << given.name << YAML::Value << repetition.alone.outputs[std::size_t(given.carried)].name;
  out << YAML::EndMap << YAML::Key << "repeat" << YAML::Value << YAML::BeginMap;
  write_graph(out, repetition.alone);
  out << YAML::EndMap;
}

void write_graph(YAML::Emitter& out, const Pipeline& pipeline) {
  out << YAML::Key << "nodes" << YAML::Value << YAML::BeginMap;
  for (const PipelineNode& node : pipeline.nodes) {
    out << YAML::Key << node.id << YAML::Value << YAML::BeginMap;
    if (!node.repetition) out << YAML::Key << "uses" << YAML::Value << node.info.name;
    if (node.may_fail) out << YAML::Key << "may_fail" << YAML::Value << true;
    if (!node.wires.empty()) {
      out << YAML::Key << "in" << YAML::Value << YAML::Flow << YAML::BeginMap;
      for (const Wire& wire : node.wires) {
        out << YAML::Key << node.info.inputs[std::size_t(wire.port)].name << YAML::Value;
        if (wire.is_list_literal) out << YAML::BeginSeq;
        for (const Reference& source : wire.sources) out << source.text;
        if (wire.is_list_literal) out << YAML::EndSeq;
      }
      out << YAML::EndMap;
    }
    if (!node.options.empty()) write_options(out, node);
    if (node.repetition) write_repetition(out, *node.repetition);
    out << YAML::EndMap;
  }
  out << YAML::EndMap << YAML::Key << "outputs" << YAML::Value << YAML::BeginMap;
  for (const PipelineOutput& output : pipeline.outputs)
    out << YAML::Key << output.name << YAML::Value << output.source.text;
  out << YAML::EndMap;
}

}  // namespace

std::vector<std::string> Pipeline::axes_of(const Reference& source) const {
  const PipelineNode& node = nodes[std::size_t(source.node)];
  std::vector<std::string> axes = node.mapped_axes;
  if (node.repetition) return axes_of_passes(node, source);
  const std::string& own = node.info.outputs[std::size_t(source.output)].axis;
  if (!own.empty()) axes.push_back(own);
  axes.erase(axes.begin(), axes.begin() + std::ptrdiff_t(std::min(axes.size(), source.items.size())));
  return axes;
}

std::vector<bool> Pipeline::needed(const std::function<bool(const std::string&)>& given) const {
  std::vector<bool> result(nodes.size(), false);
  for (const PipelineOutput& output : outputs) result[std::size_t(output.source.node)] = true;
  for (std::size_t i = nodes.size(); i-- > 0;) {
    if (result[i] && given && given(nodes[i].id)) result[i] = false;
    if (!result[i]) continue;
    for (const Wire& wire : nodes[i].wires)
      for (const Reference& source : wire.sources) result[std::size_t(source.node)] = true;
  }
  return result;
}

std::vector<const PipelineNode*> called_nodes(const Pipeline& pipeline) {
  std::vector<const PipelineNode*> all;
  const auto add = [&](const auto& self, const Pipeline& graph, const std::vector<Repetition::Given>& given) -> void {
    const auto is_given = [&](const std::string& id) {
      return std::any_of(given.begin(), given.end(), [&](const Repetition::Given& one) { return one.node == id; });
    };
    const std::vector<bool> needed = graph.needed(is_given);
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
      if (!needed[i]) continue;
      const PipelineNode& node = graph.nodes[i];
      if (node.repetition)
        self(self, node.repetition->first, node.repetition->given);
      else
        all.push_back(&node);
    }
  };
  add(add, pipeline, {});
  return all;
}

std::string resolved_yaml(const Pipeline& pipeline) {
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::BeginMap << YAML::Key << "marrow" << YAML::Value << 1 << YAML::Key << "name" << YAML::Value
      << pipeline.name;
  write_graph(out, pipeline);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace marrow
