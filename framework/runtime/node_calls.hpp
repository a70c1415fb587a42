// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "evaluation.hpp"

namespace marrow {

/// The calls of one node.
struct NodeCalls {
  std::vector<Call> calls;
  std::vector<std::vector<std::string>> names;  ///< along each mapped axis
};

/// Gathers the node's inputs and spreads them over the mapped axes. Throws Error where lists do not go in step.
void make_calls(const Pipeline& pipeline, const RunResult& result, std::size_t index, NodeCalls& made);

/// Why a call cannot be made, or an empty text. Sets `skipped` where an input simply is not there.
std::string obstacle(const PipelineNode& node, const Call& call, NodeRecord::Status& status);

/// What the calls came to: the node's status, with the reason of anything but done.
void set_status(const std::vector<Call>& calls, NodeRecord& record);

/// One output of the node, a nest of lists along the mapped axes.
Value output_of(const PipelineNode& node, const NodeCalls& made, std::size_t output);

}  // namespace marrow
