// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <set>
#include <string>

#include "marrow/runtime/pipeline/input_texts.hpp"

namespace marrow {

/// A body that was read and checked as a pipeline of its own.
struct ReadBody {
  Pipeline pipeline;
  std::set<std::string> incomplete;  ///< nodes with an option that names an input without a value
};
using BodyReader = std::function<ReadBody(const PipelineArguments& arguments)>;

/// Makes the repetition of a node and its inputs and outputs from its body. If the body has faults, `node.info` stays
/// empty.
void resolve_repetition(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts,
                        const BodyReader& read_body, Diagnostics& diagnostics);

/// Checks that what a node gives to its body has the axes that the body expects.
void check_axes_of_repetition(const Pipeline& pipeline, const PipelineNode& node, Diagnostics& diagnostics);

}  // namespace marrow
