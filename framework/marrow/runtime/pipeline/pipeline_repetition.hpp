// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <set>
#include <string>

#include "marrow/runtime/pipeline/input_texts.hpp"

namespace marrow {

/// A body that was read and checked as a pipeline.
struct ReadBody {
  Pipeline pipeline;
  std::set<std::string> incomplete;  ///< nodes with an option whose value is unknown, because an input has no value
};
using BodyReader = std::function<ReadBody(std::vector<InputValue> inputs)>;

/// Reads the body of a node, and makes the node's repetition, inputs and outputs from it. If the body has faults,
/// `node.info` stays empty.
void resolve_repetition(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts,
                        const BodyReader& read_body, Diagnostics& diagnostics);

/// Checks that the values that a node gives to its body have the axes that the body expects.
void check_axes_of_repetition(const Pipeline& pipeline, const PipelineNode& node, Diagnostics& diagnostics);

}  // namespace marrow
