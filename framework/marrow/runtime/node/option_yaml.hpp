// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "marrow/base/strict_yaml.hpp"
#include "marrow/runtime/node/node.hpp"

namespace MARROW_EXPORT marrow {

/// A value for an option as a person writes it, converted and checked against its range, choices and length. Faults go
/// to the diagnostics of `yaml`. `substitute` replaces $names in texts before they are read. If it returns nothing, so
/// does this function.
std::optional<OptionValue> read_option(
    StrictYaml& yaml, const YAML::Node& node, const Place& where, const OptionInfo& info, const std::string& what,
    const std::function<std::optional<std::string>(const std::string&, const Place&)>& substitute);

}  // namespace marrow
