// SPDX-License-Identifier: Apache-2.0
// Checks the declarations of nodes and kinds when a plugin registers them. So a wrong default or port is found without
// running anything.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "marrow/base/diagnostics.hpp"
#include "marrow/plugin.hpp"
#include "marrow/runtime/node/relations.hpp"

namespace marrow::detail {
namespace {

bool is_name(const std::string& text) {
  return !text.empty() && std::islower(static_cast<unsigned char>(text[0])) &&
         std::all_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::islower(c) || std::isdigit(c) || c == '_'; });
}

/// Whether a text can be shown on a terminal and written as JSON: UTF-8 without control characters.
bool is_plain(const std::string& text) try {
  if (std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; })) return false;
  nlohmann::json(text).dump();
  return true;
} catch (const nlohmann::json::exception&) {
  return false;
}

void check_texts(const std::string& what, const std::vector<std::string>& texts, std::vector<std::string>& faults) {
  if (!std::all_of(texts.begin(), texts.end(), is_plain))
    faults.push_back(what + ": its texts must be UTF-8 without control characters");
}

std::vector<double> numbers_of(const OptionValue& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return {double(*integer)};
  if (const auto* number = std::get_if<double>(&value)) return {*number};
  const auto* numbers = std::get_if<std::vector<double>>(&value);
  return numbers ? *numbers : std::vector<double>{};
}

std::vector<std::string> texts_of(const OptionValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return {*text};
  const auto* texts = std::get_if<std::vector<std::string>>(&value);
  return texts ? *texts : std::vector<std::string>{};
}

/// Checks that range and default are finite and that the default is within the range.
void check_numbers(const OptionInfo& option, const std::string& name, std::vector<std::string>& faults) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  const double least = option.minimum.value_or(-kLargest), most = option.maximum.value_or(kLargest);
  if (!std::isfinite(least) || !std::isfinite(most) || least > most)
    faults.push_back(name + ": its range is empty or not finite");
  for (const double number : numbers_of(option.default_value)) {
    if (!std::isfinite(number))
      faults.push_back(name + ": its default is not a finite number");
    else if (!option.required && (number < least || number > most))
      faults.push_back(name + ": its default is outside its own range");
  }
}

void check_option(const OptionInfo& option, std::vector<std::string>& faults) {
  const std::string name = "option '" + option.name + "'";
  if (option.help.empty()) faults.push_back(name + ": has no line of help");
  check_texts(name, {option.help, option.unit}, faults);
  check_texts(name, option.choices, faults);
  check_texts(name, texts_of(option.default_value), faults);
  check_numbers(option, name, faults);
  const auto* text = std::get_if<std::string>(&option.default_value);
  if (text && !option.required && !option.choices.empty() &&
      std::find(option.choices.begin(), option.choices.end(), *text) == option.choices.end())
    faults.push_back(name + ": its default '" + *text + "' is not one of its choices");
}

/// Each name is that of an option, or input.option with an input that takes functions.
void check_replaces(const NodeInfo& node, const OptionInfo& option, std::vector<std::string>& faults) {
  for (const std::string& name : option.replaces) {
    const std::string what = "option '" + option.name + "' replaces '" + name + "': ";
    const std::size_t dot = name.find('.');
    if (!is_name(name.substr(dot + 1))) faults.push_back(what + "names are lower_case");
    if (dot != std::string::npos && std::none_of(node.inputs.begin(), node.inputs.end(), [&](const PortInfo& input) {
          return input.type.is_function && input.name == name.substr(0, dot);
        }))
      faults.push_back(what + "there is no input '" + name.substr(0, dot) + "' that takes functions");
  }
}

void check_beside(const OptionInfo& option, std::vector<std::string>& faults) {
  const std::string what = "option '" + option.name + "': beside: ";
  if (!option.beside.empty() && option.type != OptionType::path)
    faults.push_back(what + "files can lie beside an option of type path only");
  for (const std::string& ending : option.beside)
    if (ending.size() < 2 || ending[0] != '.' || ending.find('/') != std::string::npos)
      faults.push_back(what + "an ending begins with a dot, as .onnx, but this is '" + ending + "'");
}

const std::string& name_of(const std::string& name) { return name; }
template <class Item>
const std::string& name_of(const Item& item) {
  return item.name;
}

/// Checks that names are well formed and that none occurs twice.
template <class Item>
void check_names(const std::vector<Item>& items, const std::string& what, std::vector<std::string>& faults) {
  std::set<std::string> seen;
  for (const Item& item : items) {
    const std::string& name = name_of(item);
    if (!is_name(name)) faults.push_back(what + " '" + name + "': names are lower_case");
    if (!seen.insert(name).second) faults.push_back(what + " '" + name + "' is named twice");
  }
}

std::vector<TypeInfo> types_of(const PortInfo& port) { return {port.type}; }
const std::vector<TypeInfo>& types_of(const KindPort& port) { return port.types; }

template <class Port>
void check_ports(const std::vector<Port>& ports, const std::string& what, std::vector<std::string>& faults) {
  check_names(ports, what, faults);
  for (const Port& port : ports) {
    const std::string name = what + " '" + port.name + "'";
    std::vector<std::string> texts{port.help, port.axis};
    for (const TypeInfo& type : types_of(port)) texts.push_back(type.id);
    if (texts.size() == 2) faults.push_back(name + ": has no type");
    check_texts(name, texts, faults);
  }
}

/// What is wrong with a name in a relation; empty if nothing is.
std::string fault_in_relation(const NodeInfo& node, RelationType type, const std::string& name) {
  const bool is_about_given = type == RelationType::exactly_one || type == RelationType::at_least_one;
  if (is_about_given && name.starts_with("in.")) {
    for (const PortInfo& port : node.inputs)
      if (port.name == name.substr(3)) return port.optional ? "" : "input '" + port.name + "' is always wired";
    return "there is no input '" + name.substr(3) + "'";
  }
  const auto option =
      std::find_if(node.options.begin(), node.options.end(), [&](const OptionInfo& info) { return info.name == name; });
  if (option == node.options.end()) {
    std::vector<std::string> known;
    for (const OptionInfo& info : node.options) known.push_back(info.name);
    return "there is no option '" + name + "'; " + suggestion(name, known);
  }
  const OptionType is = option->type;
  const bool is_number = is == OptionType::number || is == OptionType::integer;
  const bool is_list = is == OptionType::numbers || is == OptionType::texts || is == OptionType::paths;
  if ((type == RelationType::not_above || type == RelationType::below) && !is_number)
    return "option '" + name + "' is not a number";
  if (!is_about_given && type != RelationType::not_above && type != RelationType::below && !is_list)
    return "option '" + name + "' is not a list";
  if (is_about_given && (is_number || is == OptionType::boolean))
    return "option '" + name + "' is never empty, so it is always given";
  return "";
}

void check_relation(const NodeInfo& node, const RelationInfo& relation, std::vector<std::string>& faults) {
  const std::string what = std::string("relation ") + kRelationTypes[std::size_t(relation.type)] + ": ";
  const RelationType type = relation.type;
  const std::size_t count = relation.names.size();
  if (type == RelationType::distinct) {
    if (count != 1) faults.push_back(what + "it needs one name");
  } else if (type == RelationType::at_least_one) {
    if (count == 0) faults.push_back(what + "it needs a name");
  } else if (type == RelationType::same_length || type == RelationType::exactly_one) {
    if (count < 2) faults.push_back(what + "it needs two names or more");
  } else if (count != 2) {
    faults.push_back(what + "it needs two names");
  }
  for (const std::string& name : relation.names)
    if (const std::string fault = fault_in_relation(node, relation.type, name); !fault.empty())
      faults.push_back(what + fault);
}

}  // namespace

void check_declaration(NodeDefinition& node) {
  std::vector<std::string>& faults = node.faults;
  const NodeInfo& info = node.info;
  const std::size_t dot = info.name.find('.');
  if (dot == std::string::npos || !is_name(info.name.substr(0, dot)) || !is_name(info.name.substr(dot + 1)))
    faults.push_back("a node's name is kind.name in lower_case");
  if (info.summary.empty()) faults.push_back("has no summary");
  if (info.outputs.empty()) faults.push_back("has no output: name what the function returns with .out()");
  check_ports(info.inputs, "input", faults);
  check_ports(info.outputs, "output", faults);
  check_texts("summary", {info.summary}, faults);
  check_names(info.options, "option", faults);
  for (const OptionInfo& option : info.options) {
    check_option(option, faults);
    check_replaces(info, option, faults);
    check_beside(option, faults);
  }
  for (const RelationInfo& relation : info.relations) check_relation(info, relation, faults);
  check_names(info.traits, "trait", faults);
}

void check_declaration(KindDefinition& kind) {
  std::vector<std::string>& faults = kind.faults;
  const KindInfo& info = kind.info;
  if (!is_name(info.name)) faults.push_back("a kind's name is lower_case, without a dot");
  if (info.summary.empty() && !info.is_suite) faults.push_back("has no summary");
  if (info.is_suite && info.checks.empty()) faults.push_back("its suite has no checks");
  check_texts("summary", {info.summary}, faults);
  check_ports(info.inputs, "input", faults);
  check_ports(info.outputs, "output", faults);
  for (const TraitInfo& trait : info.traits) check_texts("trait '" + trait.name + "'", {trait.help}, faults);
  for (const CheckInfo& check : info.checks) {
    check_texts("check '" + check.name + "'", {check.what, check.unit}, faults);
    if (!std::isfinite(check.limit)) faults.push_back("check '" + check.name + "': its limit is not a finite number");
  }
  check_names(info.traits, "trait", faults);
  check_names(info.checks, "check", faults);
}

}  // namespace marrow::detail
