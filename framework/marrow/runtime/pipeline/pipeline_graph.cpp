// SPDX-License-Identifier: Apache-2.0
// What a checked pipeline can be asked, and its YAML.
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {
namespace {

/// An item of an option as YAML shows it. Dollars in a text are doubled, because one dollar begins the name of an
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

/// The axes of an output of a node with a body. It has each output of the body twice: over all passes, and of the last
/// pass.
std::vector<std::string> axes_of_passes(const Repetition& repetition, int output) {
  std::vector<std::string> axes = repetition.body.axes_of(repetition.body.outputs[std::size_t(output / 2)].source);
  if (output % 2 == 0) axes.insert(axes.begin(), repetition.axis);
  return axes;
}

/// `repetition`: the one whose body the pipeline is, or null.
void add_called(const Pipeline& pipeline, const Repetition* repetition, std::vector<const PipelineNode*>& called) {
  const std::vector<bool> needed =
      pipeline.needed([&](const std::string& id) { return repetition && repetition->is_given(id); });
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    if (!needed[i]) continue;
    const PipelineNode& node = pipeline.nodes[i];
    if (node.repetition)
      add_called(node.repetition->first, node.repetition.get(), called);
    else
      called.push_back(&node);
  }
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
        out << YAML::Key << node.input_of(wire).name << YAML::Value;
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
  const PipelineNode& node = node_of(source);
  std::vector<std::string> axes = node.mapped_axes;
  if (node.repetition)
    axes = axes_of_passes(*node.repetition, source.output);
  else if (const std::string& own = output_of(source).axis; !own.empty())
    axes.push_back(own);
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

bool Repetition::is_given(const std::string& id) const {
  return std::any_of(given.begin(), given.end(), [&](const Given& one) { return one.node == id; });
}

std::vector<const PipelineNode*> called_nodes(const Pipeline& pipeline) {
  std::vector<const PipelineNode*> called;
  add_called(pipeline, nullptr, called);
  return called;
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

std::string no_writer(const TypeInfo& type) { return "no plugin writes values of type '" + type.id + "'"; }

void check_writers(const Pipeline& pipeline, const Catalogue& catalogue, Diagnostics& diagnostics) {
  for (const auto& [name, source] : pipeline.outputs) {
    if (source.node < 0) continue;  // its node is unknown, which was reported already
    const TypeInfo& type = pipeline.output_of(source).type;
    if (catalogue.find_writer(type) || pipeline.only_inside) continue;
    if (type.is_function)
      diagnostics.add(source.place, "output '" + name + "' is a function (" + type.id + "), which no file can hold",
                      "leave it out; or, if no command runs the pipeline but only the program itself, say  "
                      "only_inside: true");
    else
      diagnostics.add(source.place, "output '" + name + "': " + no_writer(type),
                      "leave it out, or name a result of another type");
  }
}

}  // namespace marrow
