// SPDX-License-Identifier: Apache-2.0
// Checks of a node's declaration when its plugin registers it: a wrong default or port is found without running
// anything.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "marrow/plugin.hpp"
#include "marrow/runtime/kinds.hpp"

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

/// That range and default can be written down, and the default lies in the range.
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
  if (!is_name(option.name)) faults.push_back(name + ": names are lower_case");
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

void check_ports(const std::vector<PortInfo>& ports, const char* what, std::vector<std::string>& faults) {
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const std::string port = std::string(what) + " '" + ports[i].name + "'";
    if (!is_name(ports[i].name)) faults.push_back(port + ": names are lower_case");
    check_texts(port, {ports[i].help, ports[i].axis, ports[i].type.id}, faults);
    for (std::size_t j = 0; j < i; ++j)
      if (ports[j].name == ports[i].name) faults.push_back(port + " is named twice");
  }
}

/// That every port of the node is one of the contract's.
void check_against(const std::vector<PortInfo>& ports, const std::vector<KindPort>& contract, const std::string& kind,
                   const char* what, std::vector<std::string>& faults) {
  for (const PortInfo& port : ports) {
    const auto found =
        std::find_if(contract.begin(), contract.end(), [&](const KindPort& p) { return p.name == port.name; });
    if (found == contract.end()) {
      faults.push_back(std::string(what) + " '" + port.name + "': the kind '" + kind + "' has none of that name");
    } else if (found->type != port.type.id || found->axis != port.axis) {
      const auto say = [](const std::string& type, const std::string& axis) {
        return axis.empty() ? type : "list of " + type + " over " + axis;
      };
      faults.push_back(std::string(what) + " '" + port.name + "': the kind '" + kind + "' has it as " +
                       say(found->type, found->axis) + ", not " + say(port.type.id, port.axis));
    }
  }
}

}  // namespace

std::string unit_of_name(const std::string& name) {
  static constexpr std::array<const char*, 8> kUnits{"mm", "deg", "rad", "px", "s", "hu", "kev", "percent"};
  const std::size_t underscore = name.rfind('_');
  const std::string suffix = underscore == std::string::npos ? name : name.substr(underscore + 1);
  if (underscore == std::string::npos) return "";
  for (const char* unit : kUnits)
    if (suffix == unit) return suffix == "hu" ? "HU" : suffix == "kev" ? "keV" : suffix == "percent" ? "%" : suffix;
  return "";
}

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
  std::set<std::string> names;
  for (const OptionInfo& option : info.options) {
    check_option(option, faults);
    if (!names.insert(option.name).second) faults.push_back("option '" + option.name + "' is named twice");
  }

  const Kind* kind = find_kind(info.kind());
  if (!kind || !kind->sees_truth)
    for (const PortInfo& port : info.inputs)
      if (port.type.id == TypeInfo::of<Truth>().id)
        faults.push_back("input '" + port.name + "': only nodes that evaluate or render may be given the truth");
  if (!kind || kind->open) return;
  check_against(info.inputs, kind->inputs, kind->name, "input", faults);
  check_against(info.outputs, kind->outputs, kind->name, "output", faults);
  for (const KindPort& port : kind->outputs)
    if (std::none_of(info.outputs.begin(), info.outputs.end(), [&](const PortInfo& p) { return p.name == port.name; }))
      faults.push_back("output '" + port.name + "' is missing: every node of the kind '" + kind->name + "' has it");
}

}  // namespace marrow::detail
