// SPDX-License-Identifier: Apache-2.0
#include "strict_yaml.hpp"

#include <algorithm>

#include "domain/exact_number.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/plain_text.hpp"
#include "marrow/domain/printable.hpp"
#include "marrow/domain/yaml.hpp"
#include "text_file.hpp"
#include "unclosed.hpp"

namespace marrow {

YAML::Node StrictYaml::parse(const std::string& written) {
  const std::string text = plain_text(written);
  try {
    return parse_yaml(text);
  } catch (const YAML::ParserException& error) {
    fault({file_, error.mark.line + 1, error.mark.column + 1}, "not valid YAML: " + error.msg);
    // The parser reports the place where the text ends or goes on strangely. The typing error is where something was
    // left open.
    if (const auto opened = last_unclosed(text))
      fault({file_, opened->line, opened->column}, std::string("this ") + opened->mark + " is not closed");
  } catch (const YAML::Exception& error) {
    fault({file_, error.mark.line + 1, error.mark.column + 1}, "cannot be read as YAML: " + error.msg);
  }
  return {};
}

Place StrictYaml::place_of(const YAML::Mark& mark) const {
  return only_ ? *only_ : Place{file_, mark.line + 1, mark.column + 1};
}

std::vector<YamlEntry> StrictYaml::map(const YAML::Node& node, const Place& where, const std::string& what,
                                       const std::vector<std::string>* known) {
  std::vector<YamlEntry> entries;
  if (!node.IsMap()) {
    fault(where, what + " must be a map, got " + yaml_described(node), "write it as  key: value  lines");
    return entries;
  }
  std::vector<YamlFault> faults;
  for (const YamlKey& key : yaml_keys(node, what, faults)) {
    const Place key_place = place_of(key.mark);
    if (known && std::find(known->begin(), known->end(), key.name) == known->end())
      fault(key_place, "unknown key " + in_quotes(key.name) + " in " + what, suggestion(key.name, *known));
    else
      entries.push_back({key.name, key_place, key.value});
  }
  for (const YamlFault& one : faults) fault(place_of(one.mark), one.text, one.hint);
  return entries;
}

std::optional<std::string> StrictYaml::text(const YAML::Node& node, const Place& where, const std::string& what) {
  if (node.IsScalar()) return node.Scalar();
  fault(where, what + ": expected a text, got " + yaml_described(node));
  return std::nullopt;
}

std::optional<bool> StrictYaml::boolean(const YAML::Node& node, const Place& where, const std::string& what) {
  const std::optional<bool> value = yaml_boolean(node);
  if (!value) fault(where, what + ": expected true or false, got " + yaml_described(node));
  return value;
}

std::optional<std::int64_t> StrictYaml::integer(const YAML::Node& node, const Place& where, const std::string& what) {
  const std::optional<std::int64_t> value = yaml_integer(node);
  if (!value)
    fault(where, what + ": expected an integer, got " + yaml_described(node),
          has_leading_zeros(node) ? "write it without leading zeros" : "");
  return value;
}

std::optional<double> StrictYaml::number(const YAML::Node& node, const Place& where, const std::string& what) {
  const std::optional<double> value = yaml_number(node);
  if (!value) fault(where, what + ": expected a number, got " + yaml_described(node));
  return value;
}

bool StrictYaml::check_range(double value, const Place& where, const OptionInfo& info, const std::string& what) {
  const std::string unit = info.unit.empty() ? "" : " " + info.unit;
  if (info.minimum && value < *info.minimum) {
    fault(where,
          what + ": " + exact_number(value) + " is below the least allowed, " + exact_number(*info.minimum) + unit);
    return false;
  }
  if (info.maximum && value > *info.maximum) {
    fault(where,
          what + ": " + exact_number(value) + " is above the most allowed, " + exact_number(*info.maximum) + unit);
    return false;
  }
  return true;
}

std::optional<OptionValue> StrictYaml::option(
    const YAML::Node& original, const Place& where, const OptionInfo& info, const std::string& what,
    const std::function<std::optional<std::string>(const std::string&, const Place&)>& substitute) {
  bool known = true;  // every $name has a value
  const auto replaced = [&](const YAML::Node& node) {
    if (!node.IsScalar() || node.Scalar().find('$') == std::string::npos) return node;
    const auto text = substitute(node.Scalar(), place(node));
    known = known && text;
    return YAML::Node(text.value_or(""));
  };
  const YAML::Node node = replaced(original);
  if (!known) return std::nullopt;
  switch (info.type) {
    case OptionType::boolean:
      if (const auto value = boolean(node, where, what)) return *value;
      return std::nullopt;
    case OptionType::integer:
      if (const auto value = integer(node, where, what); value && check_range(double(*value), where, info, what))
        return *value;
      return std::nullopt;
    case OptionType::number:
      if (const auto value = number(node, where, what); value && check_range(*value, where, info, what)) return *value;
      return std::nullopt;
    case OptionType::text:
    case OptionType::path: {
      const auto value = text(node, where, what);
      if (!value) return std::nullopt;
      if (!info.choices.empty() && std::find(info.choices.begin(), info.choices.end(), *value) == info.choices.end()) {
        fault(where, what + ": " + in_quotes(*value) + " is not one of its choices", suggestion(*value, info.choices));
        return std::nullopt;
      }
      return *value;
    }
    default:
      break;
  }
  if (!node.IsSequence()) {
    fault(where, what + ": expected a list, got " + yaml_described(node), "write it as [a, b, c]");
    return std::nullopt;
  }
  std::vector<double> numbers;
  std::vector<std::string> texts;
  bool good = true;
  for (const YAML::Node& item : node) {
    const YAML::Node value = replaced(item);
    if (!known) return std::nullopt;
    if (info.type == OptionType::numbers) {
      const auto n = number(value, place(item), what);
      good = n && check_range(*n, place(item), info, what) && good;
      if (n) numbers.push_back(*n);
    } else {
      const auto t = text(value, place(item), what);
      good = t.has_value() && good;
      if (t) texts.push_back(*t);
    }
  }
  if (!good) return std::nullopt;
  if (info.length && numbers.size() != info.length) {
    fault(where,
          what + ": expected " + std::to_string(info.length) + " numbers, got " + std::to_string(numbers.size()));
    return std::nullopt;
  }
  if (info.type == OptionType::numbers) return numbers;
  return texts;
}

std::optional<std::string> read_source(const std::filesystem::path& file, const std::string& what,
                                       Diagnostics& diagnostics) {
  try {
    std::string text = read_text_file(file, kMostSourceBytes);
    diagnostics.remember(file.string(), plain_text(text));
    return text;
  } catch (const Error& error) {
    const std::string fault = error.what();  // begins with the file's name, which the place has already
    const auto says = [&](const char* part) { return fault.find(part, file.string().size()) != std::string::npos; };
    const char* hint = says(" is longer than ")  ? ""
                       : says("no regular file") ? "write the text to a file and give that"
                                                 : "check the path";
    diagnostics.add({file.string()}, what + fault.substr(file.string().size()), hint);
    return std::nullopt;
  }
}

}  // namespace marrow
