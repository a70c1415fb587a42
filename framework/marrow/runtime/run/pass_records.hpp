// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/runtime/run/executor.hpp"

namespace marrow {

/// Adds what one pass did to the record of all passes. `run`: the body as it was run, `done`: the records of its nodes.
/// `constants`: nodes that were given because they are the same in all passes.
void add_pass(const Repetition& repetition, const Pipeline& run, const std::vector<NodeRecord>& done,
              const std::vector<std::string>& constants, const std::string& pass, PassesRecord& record);

/// Adds what was done once, before the first pass.
void add_constants(const Repetition& repetition, const Pipeline& run, const std::vector<NodeRecord>& done,
                   PassesRecord& record);

}  // namespace marrow
