// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/runtime/run/run_folder.hpp"

namespace marrow {

/// Writes a value to `stem` and the extension of its writer, or the items of a list into the folder `stem`. `written`
/// receives the files, relative to `root`, or why there are none.
void write_value(const Value& value, const std::filesystem::path& stem, const std::filesystem::path& root,
                 const Catalogue& catalogue, RunFolder::Written& written);

}  // namespace marrow
