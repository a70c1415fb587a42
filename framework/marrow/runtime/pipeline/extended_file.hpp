// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/strict_yaml.hpp"

namespace MARROW_EXPORT marrow {

/// The file that the last file of a chain extends. `name`: the value of its key `extends`; a relative path starts at
/// the folder of that file. If there is no such file, if it is in the chain already, or if the chain is too long,
/// reports a fault and returns nothing.
std::optional<std::filesystem::path> extended_file(StrictYaml& yaml, const YAML::Node& name,
                                                   const std::vector<std::filesystem::path>& chain);

/// The hint for a YAML file that is not there: the nearest name of a YAML file in its folder, or nothing.
std::string nearest_file(const std::filesystem::path& missing);

}  // namespace marrow
