// SPDX-License-Identifier: Apache-2.0
// The values of a node's options, the relations between them, and options that have no effect.
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

#include <algorithm>

#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/option_yaml.hpp"
#include "marrow/runtime/node/relations.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

OptionValue in_folder(OptionValue value, OptionType type, const fs::path& folder) {
  const auto full = [&](const std::string& text) { return text.empty() ? text : plain_path(folder / text).string(); };
  if (type == OptionType::path) return full(std::get<std::string>(value));
  if (type == OptionType::paths)
    for (std::string& text : std::get<std::vector<std::string>>(value)) text = full(text);
  return value;
}

/// Whether a value replaces another option. An empty list and the number 0 leave the other option as it is.
bool is_set(const OptionValue& value) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) return !numbers->empty();
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return *whole != 0;
  if (const auto* number = std::get_if<double>(&value)) return *number != 0;
  return true;
}

/// The option's name with the place where its value is written.
std::string with_place(const WrittenEntry* written, const std::string& option) {
  if (!written) return in_quotes(option) + " (its default)";
  const Place& place = written->value.place;
  if (place.file.empty()) return in_quotes(option) + " (on the command line)";
  return formatted("{} ({}:{})", in_quotes(option), place.file, place.line);
}

/// Adds the nodes that make the functions on a wire, and those that made the functions of this type that they are made
/// of.
void add_makers(const Pipeline& pipeline, const Wire& wire, const TypeInfo& type, std::vector<int>& makers) {
  for (const Reference& source : wire.sources) {
    if (std::find(makers.begin(), makers.end(), source.node) != makers.end()) continue;
    makers.push_back(source.node);
    const PipelineNode& maker = pipeline.node_of(source);
    for (const Wire& inner : maker.wires)
      if (maker.input_of(inner).type == type) add_makers(pipeline, inner, type, makers);
  }
}

/// The nodes whose functions reach a node, by all of its inputs or, if `input` is not empty, by this one.
std::vector<int> makers_for(const Pipeline& pipeline, const PipelineNode& node, const std::string& input) {
  std::vector<int> makers;
  for (const Wire& wire : node.wires) {
    const PortInfo& port = node.input_of(wire);
    if (port.type.is_function && (input.empty() || port.name == input)) add_makers(pipeline, wire, port.type, makers);
  }
  return makers;
}

}  // namespace

void resolve_options(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts, UnknownValues& unknown,
                     Diagnostics& diagnostics) {
  const std::vector<std::string> known = names_of(node.info.options);
  for (const auto& [name, value] : written.options)
    if (!contains(known, name))
      diagnostics.add(value.place, in_quotes(node.info.name) + " has no option " + in_quotes(name),
                      suggested(diagnostics, name, known));
  for (const OptionInfo& option : node.info.options) {
    OptionValue result = option.default_value;
    Place place;
    if (const WrittenEntry* given = find_named(written.options, option.name)) {
      const WrittenValue& value = given->value;
      place = value.place;
      StrictYaml yaml = yaml_of(value, diagnostics);
      const auto substitute = [&](const std::string& text, const Place& place) {
        return input_texts.put_into(text, place.line ? place : value.place, value.inputs.get());
      };
      auto converted = read_option(yaml, value.value, value.place, option,
                                   "option " + in_quotes(option.name) + " of " + node.info.name, substitute);
      if (converted)
        result = in_folder(std::move(*converted), option.type, value.folder);
      else
        unknown.insert({&written, option.name});
    } else if (option.required) {
      unknown.insert({&written, option.name});
      diagnostics.add(written.place,
                      "node " + in_quotes(node.id) + ": option " + in_quotes(option.name) + " of " + node.info.name +
                          " must be given",
                      option.help);
    }
    node.options.push_back(std::move(result));
    node.option_places.push_back(std::move(place));
  }
}

void check_relations(const WrittenNode& written, const PipelineNode& node, const UnknownValues& unknown,
                     Diagnostics& diagnostics) {
  const auto is_wired = [&](const std::string& name) { return find_named(written.wires, name) != nullptr; };
  for (const RelationInfo& relation : node.info.relations) {
    Place place = written.place;
    bool is_known = true;
    for (const std::string& name : relation.names) {
      is_known = is_known && !unknown.contains({&written, name});
      const bool is_input = name.starts_with("in.");
      const WrittenEntry* given =
          is_input ? find_named(written.wires, name.substr(3)) : find_named(written.options, name);
      if (given) place = given->value.place;
    }
    if (!is_known) continue;
    if (const auto fault = broken(relation, node.info, node.options, is_wired))
      diagnostics.add(place, fault->message, fault->hint);
  }
}

std::vector<std::string> notes_of_replaced_options(const WrittenPipeline& written, const Pipeline& pipeline) {
  std::vector<std::string> notes;
  for (std::size_t user = 0; user < pipeline.nodes.size(); ++user) {
    const PipelineNode& node = pipeline.nodes[user];
    for (std::size_t i = 0; i < node.options.size(); ++i) {
      if (!is_set(node.options[i])) continue;
      const OptionInfo& by = node.info.options[i];
      const std::string by_text = with_place(find_named(written.nodes[user].options, by.name), by.name);
      for (const std::string& replaced : by.replaces) {  // an option, or input.option
        const std::size_t dot = replaced.find('.');
        const std::string input = dot == std::string::npos ? "" : replaced.substr(0, dot);
        const std::string option = replaced.substr(dot + 1);  // all of it if there is no dot
        for (const int maker : makers_for(pipeline, node, input)) {
          const WrittenNode& from = written.nodes[std::size_t(maker)];
          if (const WrittenEntry* given = find_named(from.options, option))
            notes.push_back("node " + in_quotes(from.id) + ": the option " + with_place(given, option) +
                            " does not count in node " + in_quotes(node.id) + ": " + by_text +
                            " of that node takes its place");
        }
      }
    }
  }
  return notes;
}

}  // namespace marrow
