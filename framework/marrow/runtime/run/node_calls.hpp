// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/runtime/run/evaluation.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// The calls of one node.
struct NodeCalls {
  std::vector<Call> calls;
  std::vector<std::vector<std::string>> names;  ///< along each mapped axis
};

/// Collects the node's inputs and makes a call for each item along the mapped axes. Throws Error if two lists have
/// different names along an axis.
void make_calls(const Pipeline& pipeline, const RunResult& result, std::size_t index, NodeCalls& made);

/// Why a call cannot be made; empty if it can. If it cannot, `status` is set: skipped if an input does not exist,
/// not_run if an input could not be made, failed if its node failed and may fail. Removes such inputs if the call can
/// do without them.
std::string obstacle(const PipelineNode& node, Call& call, NodeRecord::Status& status);

/// Sets the status of the node from its calls, with the reason if it is not done.
void set_status(const std::vector<Call>& calls, NodeRecord& record);

/// One output of the node: nested lists along the mapped axes.
Value output_of(const PipelineNode& node, const NodeCalls& made, std::size_t output);

/// The item of that name along the value's outermost axis. Throws Error with the nearest known names if there is none.
Value picked(const Value& value, const std::string& item, const std::string& reference);

/// The names along an axis, at any level of nested lists; empty if the value has no such axis.
std::vector<std::string> names_along(const Value& value, const std::string& axis);

/// The value at one position along an axis; unchanged if the value has no such axis.
Value sliced(const Value& value, const std::string& axis, std::size_t index);

/// The key of a value, as part of the keys of the nodes that use it. It is the value's own key. For a list, it is made
/// from the axis and from the names and keys of the items.
Digest key_of(const Value& value);

}  // namespace marrow
