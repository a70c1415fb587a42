// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <vector>

#include "marrow/runtime/run/executor.hpp"

namespace marrow::cli {

/// Outputs that were not made although no node failed, by the reason: "node 'bone' (its type) needs 'seeds', which node
/// 'case' (its type) does not give". An output is left out of it if only its own node lacks something, as a figure that
/// needs a truth: it is there only for data that have one.
std::map<std::string, std::vector<std::string>> lacking_outputs(const Pipeline& pipeline, const RunResult& result);

/// Prints a line for each reason.
void print_lacking_outputs(const Pipeline& pipeline, const RunResult& result);

}  // namespace marrow::cli
