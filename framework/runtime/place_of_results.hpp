// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline.hpp"

namespace marrow {

/// That `place`, to which a run writes, lies in no folder that a node of it reads: all files of that folder count, so
/// that they would never be the same before and after. `what` and `advice` are for the sentence. Throws Error.
void expect_nothing_reads(const Pipeline& pipeline, const std::filesystem::path& place, const std::string& what,
                          const std::string& advice);

/// The first of the folders in which `place` lies, with all links followed; nothing where it lies in none.
std::optional<std::filesystem::path> folder_that_holds(const std::vector<std::filesystem::path>& folders,
                                                       const std::filesystem::path& place);

}  // namespace marrow
