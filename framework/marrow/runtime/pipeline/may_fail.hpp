// SPDX-License-Identifier: Apache-2.0
#pragma once
// What follows when a node fails that may fail. Nodes that can do without its outputs still run.
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// Adds a fault for each wire from a node that may fail to a node that may not fail but needs the wire. A node needs
/// the wires of inputs that are not optional, and a wire that alone decides for which items the node is called.
void check_may_fail(const Pipeline& pipeline, Diagnostics& diagnostics);

/// Removes the inputs of a call that are missing because a node failed that may fail, as if they were not wired. If an
/// item of a list is missing, the whole list is removed. Returns why the call cannot be made without these inputs;
/// empty if it can.
std::string leave_out_failed(const PipelineNode& node, std::vector<Value>& inputs);

/// Throws Error if the items along the axis are unknown because a node failed that may fail. This looks at optional
/// inputs only: leave_out_failed() reports the others. `inputs` are those of the whole node.
void expect_items(const Pipeline& pipeline, const PipelineNode& node, const std::vector<Value>& inputs,
                  const std::string& axis);

}  // namespace marrow
