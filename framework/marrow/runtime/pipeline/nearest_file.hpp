// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The hint for a YAML file that is not there: the nearest name of a YAML file in its folder, or nothing.
std::string nearest_file(const std::filesystem::path& missing);

}  // namespace marrow
