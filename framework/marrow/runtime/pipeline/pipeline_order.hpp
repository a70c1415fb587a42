// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// The order of the nodes in which sources come before users, and which otherwise keeps the given order. No nodes may
/// wait for each other (pipeline_circles.hpp).
std::vector<std::size_t> pipeline_order(const std::vector<PipelineNode>& nodes);

}  // namespace marrow
