// SPDX-License-Identifier: Apache-2.0
// What a checked pipeline can be asked, and its YAML.
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
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

class GraphWriter {
 public:
  /// `file`: that of the whole pipeline, if places are wanted.
  GraphWriter(YAML::Emitter& out, const std::filesystem::path* file) : out_(out), file_(file) {}

  void write(const Pipeline& pipeline) {
    out_ << YAML::Key << "nodes" << YAML::Value << YAML::BeginMap;
    for (const PipelineNode& node : pipeline.nodes)
      if (!node.stands_for_input) write(node);
    out_ << YAML::EndMap << YAML::Key << "outputs" << YAML::Value << YAML::BeginMap;
    for (const PipelineOutput& output : pipeline.outputs)
      out_ << YAML::Key << output.name << YAML::Value << output.source.text;
    out_ << YAML::EndMap;
  }

  void write_inputs(const Pipeline& pipeline) {
    bool has_inputs = false;
    for (const PipelineNode& node : pipeline.nodes) {
      if (!node.stands_for_input) continue;
      if (!has_inputs) out_ << YAML::Key << "inputs" << YAML::Value << YAML::BeginMap;
      has_inputs = true;
      const PortInfo& input = node.info.outputs[0];
      out_ << YAML::Key << node.id << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "type" << YAML::Value
           << input.type.id;
      if (!input.axis.empty()) out_ << YAML::Key << "over" << YAML::Value << input.axis;
      if (input.optional) out_ << YAML::Key << "optional" << YAML::Value << true;
      out_ << YAML::EndMap;
    }
    if (has_inputs) out_ << YAML::EndMap;
  }

 private:
  void write(const PipelineNode& node) {
    out_ << YAML::Key << node.id << YAML::Value;
    if (file_) out_ << YAML::Comment(place_text(node.place, *file_));
    out_ << YAML::BeginMap;
    if (!node.repetition) {
      out_ << YAML::Key << "uses" << YAML::Value << node.info.name;
      if (file_ && node.uses_place.file != node.place.file) write_place(node, node.uses_place);
    }
    if (node.may_fail) out_ << YAML::Key << "may_fail" << YAML::Value << true;
    if (!node.wires.empty()) {
      out_ << YAML::Key << "in" << YAML::Value << YAML::Flow << YAML::BeginMap;
      for (const Wire& wire : node.wires) {
        out_ << YAML::Key << node.input_of(wire).name << YAML::Value;
        if (wire.is_list_literal) out_ << YAML::BeginSeq;
        for (const Reference& source : wire.sources) out_ << source.text;
        if (wire.is_list_literal) out_ << YAML::EndSeq;
      }
      out_ << YAML::EndMap;
    }
    if (!node.options.empty()) write_options(node);
    if (node.repetition) write(*node.repetition);
    out_ << YAML::EndMap;
  }

  void write_options(const PipelineNode& node) {
    out_ << YAML::Key << "with" << YAML::Value << YAML::BeginMap;
    for (std::size_t i = 0; i < node.options.size(); ++i) {
      out_ << YAML::Key << node.info.options[i].name << YAML::Value;
      std::visit(
          [&](const auto& value) {
            if constexpr (requires { value.begin(); } && !std::is_same_v<std::decay_t<decltype(value)>, std::string>) {
              out_ << YAML::Flow << YAML::BeginSeq;
              for (const auto& item : value) out_ << written(item);
              out_ << YAML::EndSeq;
            } else if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
              if (file_)
                out_ << exact_number(value);  // for people: 0.7, where the usual digits are 0.69999999999999996
              else
                out_ << value;
            } else {
              out_ << written(value);
            }
          },
          node.options[i]);
      if (file_) write_place(node, node.option_places[i]);
    }
    out_ << YAML::EndMap;
  }

  void write_place(const PipelineNode& node, const Place& place) {
    if (place.file.empty())
      out_ << YAML::Comment("default");
    else if (place.file != node.place.file)
      out_ << YAML::Comment(place_text(place, *file_));
  }

  void write(const Repetition& repetition) {
    if (!repetition.is_loop) out_ << YAML::Key << "over" << YAML::Value << repetition.axis;
    if (repetition.at_most) out_ << YAML::Key << "at_most" << YAML::Value << repetition.at_most;
    if (repetition.until >= 0)
      out_ << YAML::Key << "until" << YAML::Value << repetition.alone.outputs[std::size_t(repetition.until)].name;
    if (repetition.goes_on) out_ << YAML::Key << "if_pass_fails" << YAML::Value << "go_on";
    out_ << YAML::Key << "carry" << YAML::Value << YAML::Flow << YAML::BeginMap;
    for (const Repetition::Given& given : repetition.given)
      if (given.carried >= 0)
        out_ << YAML::Key << given.name << YAML::Value << repetition.alone.outputs[std::size_t(given.carried)].name;
    out_ << YAML::EndMap << YAML::Key << "repeat" << YAML::Value << YAML::BeginMap;
    write_inputs(repetition.alone);
    write(repetition.alone);
    out_ << YAML::EndMap;
  }

  YAML::Emitter& out_;
  const std::filesystem::path* file_;
};

std::string yaml_text(const Pipeline& pipeline, const std::filesystem::path* file) {
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::BeginMap << YAML::Key << "marrow" << YAML::Value << 1 << YAML::Key << "name" << YAML::Value
      << pipeline.name;
  GraphWriter writer(out, file);
  writer.write_inputs(pipeline);
  writer.write(pipeline);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
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

std::string resolved_yaml(const Pipeline& pipeline) { return yaml_text(pipeline, nullptr); }

std::string resolved_yaml_with_places(const Pipeline& pipeline) { return yaml_text(pipeline, &pipeline.file); }

std::string place_text(const Place& place, const std::filesystem::path& file) {
  const auto on_one_line = [](const std::string& text) { return cut(printable(text), 200); };
  if (place.line == 0) return on_one_line(place.file);
  const std::filesystem::path whole = std::filesystem::absolute(place.file).lexically_normal();
  const std::string relative =
      whole.lexically_relative(std::filesystem::absolute(file).lexically_normal().parent_path()).string();
  return formatted("{}:{}", on_one_line(relative.starts_with("../..") ? whole.string() : relative), place.line);
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
