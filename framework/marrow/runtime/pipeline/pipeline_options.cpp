// SPDX-License-Identifier: Apache-2.0
// The values of a node's options, and the relations between them.
#include "marrow/runtime/pipeline/pipeline_options.hpp"
#include "marrow/runtime/node/option_yaml.hpp"

#include <algorithm>

#include "marrow/base/plain_path.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/relations.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/renamed.hpp"

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

}  // namespace

void resolve_options(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts, UnknownValues& unknown,
                     Diagnostics& diagnostics) {
  const std::vector<std::string> known = names_of(node.info.options);
  for (const auto& [name, value] : written.options)
    if (!contains(known, name))
      diagnostics.add(value.place, in_quotes(node.info.name) + " has no option " + in_quotes(name),
                      suggested_for(node.info.name, name, known, diagnostics));
  for (const OptionInfo& option : node.info.options) {
    OptionValue result = option.default_value;
    const auto given = std::find_if(written.options.begin(), written.options.end(),
                                    [&](const auto& item) { return item.first == option.name; });
    if (given != written.options.end()) {
      const WrittenValue& value = given->second;
      StrictYaml yaml = yaml_of(value, diagnostics);
      const auto substitute = [&](const std::string& text, const Place& place) {
        return input_texts.put_into(text, place.line ? place : value.place);
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
  }
}

void check_relations(const WrittenNode& written, const PipelineNode& node, const UnknownValues& unknown,
                     Diagnostics& diagnostics) {
  const auto is_wired = [&](const std::string& name) { return is_written(written.wires, name); };
  for (const RelationInfo& relation : node.info.relations) {
    Place place = written.place;
    bool is_known = true;
    for (const std::string& name : relation.names) {
      is_known = is_known && !unknown.contains({&written, name});
      const bool is_input = name.starts_with("in.");
      for (const auto& [other, given] : is_input ? written.wires : written.options)
        if (other == (is_input ? name.substr(3) : name)) place = given.place;
    }
    if (!is_known) continue;
    if (const auto fault = broken(relation, node.info, node.options, is_wired))
      diagnostics.add(place, fault->message, fault->hint);
  }
}

}  // namespace marrow
