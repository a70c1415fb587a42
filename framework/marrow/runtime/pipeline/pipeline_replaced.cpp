// SPDX-License-Identifier: Apache-2.0
// A node may set anew what the functions that reach it were made with: the levels of a registration, for example, have
// a resolution of their own. What a pipeline says at the function's own node has no effect then, so it is noted.
#include "marrow/runtime/pipeline/pipeline_replaced.hpp"

#include <set>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow {
namespace {

/// An empty list and the number 0 say "as the function itself has it".
bool is_set(const OptionValue& value) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) return !numbers->empty();
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return *whole != 0;
  if (const auto* number = std::get_if<double>(&value)) return *number != 0;
  return true;
}

const Place* place_of(const WrittenNode& node, const std::string& option) {
  for (const auto& [name, value] : node.options)
    if (name == option) return &value.place;
  return nullptr;
}

std::string in_brackets(const Place* place) {
  if (!place) return " (its default)";
  if (place->file.empty()) return " (on the command line)";
  return formatted(" ({}:{})", place->file, place->line);
}

class Replaced {
 public:
  Replaced(const WrittenPipeline& written, const Pipeline& pipeline) : written_(written), pipeline_(pipeline) {}

  std::vector<std::string> notes() {
    for (std::size_t user = 0; user < pipeline_.nodes.size(); ++user) {
      const PipelineNode& node = pipeline_.nodes[user];
      for (std::size_t i = 0; i < node.options.size(); ++i)
        for (const std::string& name : node.info.options[i].replaces)
          if (is_set(node.options[i])) note_wherever(name, user, node.info.options[i].name);
    }
    return notes_;
  }

 private:
  /// `name`: of an option, or input.option if only what reaches the node by this input counts.
  void note_wherever(const std::string& name, std::size_t user, const std::string& by) {
    const std::size_t dot = name.find('.');
    const std::string input = dot == std::string::npos ? "" : name.substr(0, dot);
    const PipelineNode& node = pipeline_.nodes[user];
    std::set<int> seen;
    for (const Wire& wire : node.wires) {
      const PortInfo& port = node.info.inputs[std::size_t(wire.port)];
      if (!port.type.is_function || (!input.empty() && port.name != input)) continue;
      for (const int source : nodes_behind(wire, port.type, seen)) {
        const WrittenNode& from = written_.nodes[std::size_t(source)];
        const std::string option = name.substr(dot + 1);  // all of it if there is no dot
        if (const Place* place = place_of(from, option))
          notes_.push_back("node " + in_quotes(from.id) + ": the option " + in_quotes(option) + in_brackets(place) +
                           " does not count in node " + in_quotes(node.id) + ": " + in_quotes(by) +
                           in_brackets(place_of(written_.nodes[user], by)) + " of that node takes its place");
      }
    }
  }

  /// The nodes that make a function, and those that made the functions of the same type that it was made of.
  std::vector<int> nodes_behind(const Wire& wire, const TypeInfo& type, std::set<int>& seen) const {
    std::vector<int> nodes;
    for (const Reference& source : wire.sources) {
      if (source.node < 0 || !seen.insert(source.node).second) continue;
      nodes.push_back(source.node);
      const PipelineNode& from = pipeline_.nodes[std::size_t(source.node)];
      for (const Wire& inner : from.wires) {
        if (!(from.info.inputs[std::size_t(inner.port)].type == type)) continue;
        const std::vector<int> further = nodes_behind(inner, type, seen);
        nodes.insert(nodes.end(), further.begin(), further.end());
      }
    }
    return nodes;
  }

  const WrittenPipeline& written_;
  const Pipeline& pipeline_;
  std::vector<std::string> notes_;
};

}  // namespace

std::vector<std::string> notes_of_replaced_options(const WrittenPipeline& written, const Pipeline& pipeline) {
  return Replaced(written, pipeline).notes();
}

}  // namespace marrow
