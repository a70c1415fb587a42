// SPDX-License-Identifier: Apache-2.0
#include "commands.hpp"

#include <yaml-cpp/emitter.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

const char* type_name(OptionType type) {
  static constexpr const char* kNames[] = {"true/false", "integer",         "number",        "text",
                                           "path",       "list of numbers", "list of texts", "list of paths"};
  return kNames[int(type)];
}

constexpr int kDigits = 10;

std::string number_text(double value) { return short_number(value, kDigits); }

/// A text with one of these characters is shown in quotes, also where YAML needs none.
bool plain_scalar(const std::string& text) {
  return !text.empty() && text.find_first_of(":#{}[]&*!|>'\"%@`,$ ") == std::string::npos && text != "true" &&
         text != "false";
}

template <class Scalar>
void put(YAML::Emitter& out, const Scalar& value) {
  out << value;
}
void put(YAML::Emitter& out, const std::string& text) {
  if (!plain_scalar(text)) out << YAML::DoubleQuoted;
  out << text;
}
template <class Item>
void put(YAML::Emitter& out, const std::vector<Item>& items) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const Item& item : items) put(out, item);
  out << YAML::EndSeq;
}

json option_json(const OptionInfo& option) {
  json j = {{"name", option.name},         {"help", option.help},
            {"unit", option.unit},         {"type", type_name(option.type)},
            {"range", range_text(option)}, {"required", option.required}};
  std::visit([&](const auto& value) { j["default"] = value; }, option.default_value);
  if (option.minimum) j["minimum"] = *option.minimum;
  if (option.maximum) j["maximum"] = *option.maximum;
  if (!option.choices.empty()) j["choices"] = option.choices;
  if (!option.replaces.empty()) j["replaces"] = replaces_text(option);
  return j;
}

json ports_json(const std::vector<KindPort>& ports) {
  json all = json::array();
  for (const KindPort& port : ports) {
    json types = json::array();
    for (const TypeInfo& type : port.types) types.push_back(type.id);
    all.push_back({{"name", port.name}, {"types", types}, {"axis", port.axis}, {"help", port.help}});
  }
  return all;
}

}  // namespace

json node_json(const NodeInfo& node) {
  json j = {{"name", node.name},        {"summary", node.summary},   {"random", node.random},
            {"traits", node.traits},    {"inputs", json::array()},   {"outputs", json::array()},
            {"options", json::array()}, {"relations", json::array()}};
  for (const PortInfo& port : node.inputs)
    j["inputs"].push_back({{"name", port.name},
                           {"type", port.type.id},
                           {"axis", port.axis},
                           {"optional", port.optional},
                           {"help", port.help}});
  for (const PortInfo& port : node.outputs)
    j["outputs"].push_back({{"name", port.name},
                            {"type", port.type.id},
                            {"axis", port.axis},
                            {"figures", port.figures},
                            {"help", port.help}});
  for (const OptionInfo& option : node.options) j["options"].push_back(option_json(option));
  for (const RelationInfo& relation : node.relations) j["relations"].push_back(relation_text(relation));
  return j;
}

json kind_json(const KindInfo& kind) {
  json j = {{"name", kind.name},
            {"summary", kind.summary},
            {"inputs", ports_json(kind.inputs)},
            {"outputs", ports_json(kind.outputs)},
            {"sees_truth", kind.sees_truth},
            {"apart", kind.apart != Apart::no},
            {"traits", json::array()},
            {"checks", json::array()}};
  for (const TraitInfo& trait : kind.traits) j["traits"].push_back({{"name", trait.name}, {"help", trait.help}});
  for (const CheckInfo& check : kind.checks) {
    j["checks"].push_back({{"name", check.name}, {"what", check.what}, {"unit", check.unit}});
    if (!check.unit.empty()) j["checks"].back()["limit"] = check.limit;
  }
  return j;
}

json fit_json(const Fit& fit) {
  const char* verdict = !fit.faults.empty() ? "no" : fit.missing.empty() ? "yes" : "with more";
  return {{"node", fit.node}, {"fits", verdict}, {"missing", fit.missing}, {"faults", fit.faults}};
}

std::string port_text(const PortInfo& port) { return types_text({port.type}, port.axis); }
std::string port_text(const KindPort& port) { return types_text(port.types, port.axis); }

std::string yaml_text(const OptionValue& value) {
  YAML::Emitter out;
  out.SetDoublePrecision(kDigits);
  std::visit([&](const auto& held) { put(out, held); }, value);
  return {out.c_str(), out.size()};
}

/// A bound of an option's range. Nothing if the bound is only the limit of the type int.
std::optional<double> bound_told(const OptionInfo& option, std::optional<double> bound) {
  using Limits = std::numeric_limits<int>;
  const bool is_of_int = option.type == OptionType::integer && (bound == Limits::min() || bound == Limits::max());
  return is_of_int ? std::nullopt : bound;
}

std::string relation_text(const RelationInfo& relation) {
  std::vector<std::string> names;
  for (const std::string& name : relation.names) names.push_back("'" + name + "'");
  const std::string all = joined(names, ", ");
  switch (relation.type) {
    case RelationType::not_above:
      return names[0] + " is not above " + names[1];
    case RelationType::below:
      return names[0] + " is below " + names[1];
    case RelationType::same_length:
      return all + " have the same length";
    case RelationType::as_many_or_none:
      return names[0] + " has as many items as " + names[1] + ", or none";
    case RelationType::exactly_one:
      return "exactly one of " + all + " is given";
    case RelationType::at_least_one:
      return names.size() > 1 ? "at least one of " + all + " is given" : all + " is not empty";
    case RelationType::distinct:
      return all + " has no item twice";
  }
  return all;
}

std::string replaces_text(const OptionInfo& option) {
  if (option.replaces.empty()) return "";
  return "takes the place of '" + joined(option.replaces, "', '") + "' of the functions that reach this node";
}

std::string range_text(const OptionInfo& option) {
  if (!option.choices.empty()) return "one of: " + joined(option.choices, ", ");
  std::string text = type_name(option.type);
  if (option.length) text = formatted("{} numbers", option.length);
  const std::optional<double> least = bound_told(option, option.minimum), most = bound_told(option, option.maximum);
  if (least && most)
    text += ", " + number_text(*least) + " to " + number_text(*most);
  else if (least)
    text += ", at least " + number_text(*least);
  else if (most)
    text += ", at most " + number_text(*most);
  return option.unit.empty() ? text : text + " [" + option.unit + "]";
}

}  // namespace marrow::cli
