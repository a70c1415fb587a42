// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "marrow/runtime/pipeline.hpp"

namespace marrow {

/// That `place`, to which a run writes, lies in no folder that a node of it reads: all files of that folder count, so that
/// they would never be the same before and after. `what` and `advice` are for the sentence. Throws Error.
void expect_nothing_reads(const Pipeline& pipeline, const std::filesystem::path& place, const std::string& what,
                          const std::string& advice);

}  // namespace marrow
