// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/node/relations.hpp"

#include <nlohmann/json.hpp>

#include "marrow/base/printable.hpp"

#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

const OptionValue& option_value_of(const NodeInfo& info, const std::vector<OptionValue>& options,
                                   const std::string& name) {
  const auto found = std::find_if(info.options.begin(), info.options.end(),
                                  [&](const OptionInfo& option) { return option.name == name; });
  return options.at(std::size_t(found - info.options.begin()));
}

double number_of(const OptionValue& value) {
  const auto* whole = std::get_if<std::int64_t>(&value);
  return whole ? double(*whole) : std::get<double>(value);
}

std::size_t length_of(const OptionValue& value) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) return numbers->size();
  return std::get<std::vector<std::string>>(value).size();
}

bool is_empty(const OptionValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return text->empty();
  return length_of(value) == 0;
}

/// An item that occurs twice, as text.
std::optional<std::string> twice(const OptionValue& value) {
  std::vector<std::string> items;
  if (const auto* numbers = std::get_if<std::vector<double>>(&value))
    for (const double number : *numbers) items.push_back(short_number(number, 10));
  else
    items = std::get<std::vector<std::string>>(value);
  std::sort(items.begin(), items.end());
  const auto found = std::adjacent_find(items.begin(), items.end());
  return found == items.end() ? std::nullopt : std::optional(*found);
}

std::string listed(const std::vector<std::string>& parts) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text += (i == 0 ? "" : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return text;
}

}  // namespace

std::optional<BrokenRelation> broken(const RelationInfo& relation, const NodeInfo& info,
                                     const std::vector<OptionValue>& options,
                                     const std::function<bool(const std::string&)>& is_wired) {
  const std::vector<std::string>& names = relation.names;
  const std::string& uses = info.name;
  if (relation.type == RelationType::not_above || relation.type == RelationType::below) {
    const double low = number_of(option_value_of(info, options, names[0])),
                 high = number_of(option_value_of(info, options, names[1]));
    const bool allows_equal = relation.type == RelationType::not_above;
    if (low < high || (allows_equal && low == high)) return std::nullopt;
    return BrokenRelation{
        formatted("option {} of {} is {:.10g}{} option {} ({:.10g})", in_quotes(names[0]), uses, low,
                  allows_equal ? ", which is above" : ", which is not below", in_quotes(names[1]), high),
        ""};
  }
  if (relation.type == RelationType::as_many_or_none) {
    const std::size_t count = length_of(option_value_of(info, options, names[0])),
                      like = length_of(option_value_of(info, options, names[1]));
    if (count == 0 || count == like) return std::nullopt;
    return BrokenRelation{formatted("option {} of {} has {}, but {} has {}", in_quotes(names[0]), uses,
                                    counted(count, "item"), in_quotes(names[1]), like),
                          "give one for each, or none"};
  }
  if (relation.type == RelationType::same_length) {
    std::vector<std::string> parts;
    bool is_same = true;
    for (const std::string& name : names) {
      parts.push_back(formatted("{} ({})", in_quotes(name), length_of(option_value_of(info, options, name))));
      is_same = is_same &&
                length_of(option_value_of(info, options, name)) == length_of(option_value_of(info, options, names[0]));
    }
    if (is_same) return std::nullopt;
    return BrokenRelation{"options " + listed(parts) + " of " + uses + " must have the same length", ""};
  }
  if (relation.type == RelationType::distinct) {
    const std::optional<std::string> item = twice(option_value_of(info, options, names[0]));
    if (!item) return std::nullopt;
    return BrokenRelation{"option " + in_quotes(names[0]) + " of " + uses + " has " + in_quotes(*item) + " twice",
                          "give each item once"};
  }
  std::vector<std::string> all, given;
  for (const std::string& name : names) {
    all.push_back(in_quotes(name));
    if (name.starts_with("in.") ? is_wired(name.substr(3)) : !is_empty(option_value_of(info, options, name)))
      given.push_back(in_quotes(name));
  }
  if (relation.type == RelationType::at_least_one) {
    if (!given.empty()) return std::nullopt;
    if (names.size() > 1) return BrokenRelation{uses + " needs at least one of " + listed(all) + ", got none", ""};
    return BrokenRelation{"option " + all[0] + " of " + uses + " is empty", "give one item or more"};
  }
  if (given.size() == 1) return std::nullopt;
  const std::string got = given.empty() ? "none" : names.size() == 2 ? "both" : listed(given);
  return BrokenRelation{uses + " needs exactly one of " + listed(all) + ", got " + got, ""};
}

nlohmann::json json_of(const OptionValue& value) {
  return std::visit([](const auto& v) { return nlohmann::json(v); }, value);
}

}  // namespace marrow
