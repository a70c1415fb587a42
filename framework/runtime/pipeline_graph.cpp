// SPDX-License-Identifier: Apache-2.0
// Queries about a checked pipeline, and its YAML.
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "marrow/runtime/pipeline.hpp"

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

}  // namespace

std::vector<std::string> Pipeline::axes_of(const Reference& source) const {
  const PipelineNode& node = nodes[std::size_t(source.node)];
  std::vector<std::string> axes = node.mapped_axes;
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

std::string resolved_yaml(const Pipeline& pipeline) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "marrow" << YAML::Value << 1 << YAML::Key << "name" << YAML::Value
      << pipeline.name;
  out << YAML::Key << "nodes" << YAML::Value << YAML::BeginMap;
  out.SetDoublePrecision(17);
  for (const PipelineNode& node : pipeline.nodes) {
    out << YAML::Key << node.id << YAML::Value << YAML::BeginMap << YAML::Key << "uses" << YAML::Value
        << node.info.name;
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
    if (!node.options.empty()) {
      out << YAML::Key << "with" << YAML::Value << YAML::BeginMap;
      for (std::size_t i = 0; i < node.options.size(); ++i) {
        out << YAML::Key << node.info.options[i].name << YAML::Value;
        std::visit(
            [&](const auto& value) {
              if constexpr (requires { value.begin(); } &&
                            !std::is_same_v<std::decay_t<decltype(value)>, std::string>) {
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
    out << YAML::EndMap;
  }
  out << YAML::EndMap << YAML::Key << "outputs" << YAML::Value << YAML::BeginMap;
  for (const PipelineOutput& output : pipeline.outputs)
    out << YAML::Key << output.name << YAML::Value << output.source.text;
  out << YAML::EndMap << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace marrow
