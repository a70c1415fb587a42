// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// The libraries that would be loaded with a library, as the system's loader lists them: with full paths, and without
/// running anything of them. Empty if it lists none, for example because one of them is not there.
std::vector<std::filesystem::path> libraries_to_load(const std::filesystem::path& library);

}  // namespace marrow
