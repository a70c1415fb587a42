// SPDX-License-Identifier: Apache-2.0
#pragma once
// What follows from the failure of a node that may fail: who can do without its outputs goes on.
#include <string>
#include <vector>

#include "marrow/base/diagnostics.hpp"
#include "marrow/runtime/node/value.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// Adds a fault for each wire from a node that may fail to a node that may not and needs it. It needs an input that is
/// not optional, and one that alone says for which items the node is called.
void check_may_fail(const Pipeline& pipeline, Diagnostics& diagnostics);

/// Takes out the inputs of a call that are not there because a node failed that may fail, as if they were not wired. A
/// list goes as a whole. Returns why the call cannot be made without them; empty if it can.
std::string leave_out_failed(const PipelineNode& node, std::vector<Value>& inputs);

/// Throws Error if no item along the axis is known because a node failed that may fail, and the input is optional.
/// `inputs` are those of the whole node.
void expect_items(const Pipeline& pipeline, const PipelineNode& node, const std::vector<Value>& inputs,
                  const std::string& axis);

}  // namespace marrow
