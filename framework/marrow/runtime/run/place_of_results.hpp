// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/run/run_folder.hpp"

namespace MARROW_EXPORT marrow {

/// Throws Error if a run writes to `place` and a node of the run reads a folder that contains it. All files of that
/// folder count as its content, so the run would change what it reads. `what` and `advice` are parts of the message.
void expect_nothing_reads(const Pipeline& pipeline, const std::filesystem::path& place, const std::string& what,
                          const std::string& advice);

/// The first of the folders that contains `place`, with all links followed; nothing if none does.
std::optional<std::filesystem::path> folder_that_holds(const std::vector<std::filesystem::path>& folders,
                                                       const std::filesystem::path& place);

/// Writes a value to `stem` and the extension of its writer, or the items of a list into the folder `stem`. `written`
/// receives the files, relative to `root`, or why there are none.
void write_value(const Value& value, const std::filesystem::path& stem, const std::filesystem::path& root,
                 const Catalogue& catalogue, RunFolder::Written& written);

}  // namespace marrow
