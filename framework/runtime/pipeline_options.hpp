// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <set>
#include <string>
#include <utility>

#include "input_texts.hpp"

namespace marrow {

/// Options whose values could not be read, by the nodes that they were written at.
using UnknownValues = std::set<std::pair<const WrittenNode*, std::string>>;

/// Gives `node` the values of its options: as written, converted and checked, or by default.
void resolve_options(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts, UnknownValues& unknown,
                     Diagnostics& diagnostics);

/// Options against each other, where each of them could be read. The fault is shown at the last one that the file
/// gives.
void check_relations(const WrittenNode& written, const PipelineNode& node, const UnknownValues& unknown,
                     Diagnostics& diagnostics);

}  // namespace marrow
