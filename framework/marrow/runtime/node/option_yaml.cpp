// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/node/option_yaml.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/yaml.hpp"

namespace marrow {
namespace {

bool is_in_range(StrictYaml& yaml, double value, const Place& where, const OptionInfo& info, const std::string& what) {
  const std::string unit = info.unit.empty() ? "" : " " + info.unit;
  if (info.minimum && value < *info.minimum) {
    yaml.fault(where, what + ": " + exact_number(value) + " is below the least allowed, " +
                          exact_number(*info.minimum) + unit);
    return false;
  }
  if (info.maximum && value > *info.maximum) {
    yaml.fault(where,
               what + ": " + exact_number(value) + " is above the most allowed, " + exact_number(*info.maximum) + unit);
    return false;
  }
  return true;
}

}  // namespace

std::optional<OptionValue> read_option(
    StrictYaml& yaml, const YAML::Node& original, const Place& where, const OptionInfo& info, const std::string& what,
    const std::function<std::optional<std::string>(const std::string&, const Place&)>& substitute) {
  bool known = true;  // every $name has a value
  const auto replaced = [&](const YAML::Node& node) {
    if (!node.IsScalar() || node.Scalar().find('$') == std::string::npos) return node;
    const auto text = substitute(node.Scalar(), yaml.place(node));
    known = known && text;
    return YAML::Node(text.value_or(""));
  };
  const YAML::Node node = replaced(original);
  if (!known) return std::nullopt;
  switch (info.type) {
    case OptionType::boolean:
      if (const auto value = yaml.boolean(node, where, what)) return *value;
      return std::nullopt;
    case OptionType::integer:
      if (const auto value = yaml.integer(node, where, what);
          value && is_in_range(yaml, double(*value), where, info, what))
        return *value;
      return std::nullopt;
    case OptionType::number:
      if (const auto value = yaml.number(node, where, what); value && is_in_range(yaml, *value, where, info, what))
        return *value;
      return std::nullopt;
    case OptionType::text:
    case OptionType::path: {
      const auto value = yaml.text(node, where, what);
      if (!value) return std::nullopt;
      if (!info.choices.empty() && std::find(info.choices.begin(), info.choices.end(), *value) == info.choices.end()) {
        yaml.fault(where, what + ": " + in_quotes(*value) + " is not one of its choices",
                   suggestion(*value, info.choices));
        return std::nullopt;
      }
      return *value;
    }
    default:
      break;
  }
  if (!node.IsSequence()) {
    yaml.fault(where, what + ": expected a list, got " + yaml_described(node), "write it as [a, b, c]");
    return std::nullopt;
  }
  std::vector<double> numbers;
  std::vector<std::string> texts;
  bool good = true;
  for (const YAML::Node& item : node) {
    const YAML::Node value = replaced(item);
    if (!known) return std::nullopt;
    if (info.type == OptionType::numbers) {
      const auto n = yaml.number(value, yaml.place(item), what);
      good = n && is_in_range(yaml, *n, yaml.place(item), info, what) && good;
      if (n) numbers.push_back(*n);
    } else {
      const auto t = yaml.text(value, yaml.place(item), what);
      good = t.has_value() && good;
      if (t) texts.push_back(*t);
    }
  }
  if (!good) return std::nullopt;
  if (info.length && numbers.size() != info.length) {
    yaml.fault(where, formatted("{}: expected {} numbers, got {}", what, info.length, numbers.size()));
    return std::nullopt;
  }
  if (info.type == OptionType::numbers) return numbers;
  return texts;
}

}  // namespace marrow
