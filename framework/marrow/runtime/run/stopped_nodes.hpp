// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/run/executor.hpp"

namespace marrow {

/// Sets `stopped` of each node that failed or was cancelled: how many of the nodes that depend on it were not called at
/// all. A node that depends on several of them counts for each.
void count_stopped_nodes(const Pipeline& pipeline, std::vector<NodeRecord>& records);

}  // namespace marrow
