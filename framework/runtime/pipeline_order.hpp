// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/runtime/pipeline.hpp"

namespace marrow {

/// The nodes with sources before users, in their own order otherwise. `stuck` gets those that wait for each other, or
/// for such.
std::vector<std::size_t> pipeline_order(const std::vector<PipelineNode>& nodes, std::vector<std::size_t>& stuck);

}  // namespace marrow
