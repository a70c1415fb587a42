// SPDX-License-Identifier: Apache-2.0
#include "conformance/given_options.hpp"

#include <filesystem>

#include "marrow/base/error.hpp"
#include "marrow/base/strict_yaml.hpp"
#include "marrow/runtime/node/option_yaml.hpp"

namespace marrow::cli {

std::map<std::string, OptionValue> given_options(const NodeInfo& node, const nlohmann::json& texts) {
  std::map<std::string, OptionValue> values;
  for (const OptionInfo& option : node.options) {
    if (!texts.contains(option.name)) continue;
    const Place place{"--set " + option.name};
    Diagnostics faults;
    StrictYaml yaml(place, faults);
    const YAML::Node parsed = yaml.parse(texts.at(option.name).get<std::string>());
    std::optional<OptionValue> value;
    if (faults.empty())
      value = read_option(yaml, parsed, place, option, "option '" + option.name + "'",
                          [](const std::string& text, const Place&) { return std::optional(text); });
    if (!value) throw Error(faults.text());
    if (option.type == OptionType::path) *value = std::filesystem::absolute(std::get<std::string>(*value)).string();
    values[option.name] = std::move(*value);
  }
  return values;
}

}  // namespace marrow::cli
