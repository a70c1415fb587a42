// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <set>
#include <string>
#include <utility>

#include "marrow/runtime/pipeline/input_texts.hpp"

namespace marrow {

/// Options whose values could not be read, each with the node for which it was written.
using UnknownValues = std::set<std::pair<const WrittenNode*, std::string>>;

/// Sets the options of `node`: to the values that are written, converted and checked, or to the defaults.
void resolve_options(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts, UnknownValues& unknown,
                     Diagnostics& diagnostics);

/// Checks the relations between options. A relation is checked only if each of its options could be read. A fault is
/// shown at the last of these options that the file gives.
void check_relations(const WrittenNode& written, const PipelineNode& node, const UnknownValues& unknown,
                     Diagnostics& diagnostics);

}  // namespace marrow
