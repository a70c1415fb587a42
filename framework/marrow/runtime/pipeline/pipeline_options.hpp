// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "marrow/runtime/pipeline/input_texts.hpp"

namespace marrow {

/// Options whose values could not be read, each with the node for which it was written.
using UnknownValues = std::set<std::pair<const WrittenNode*, std::string>>;

/// Sets the options of `node`. A written value is converted and checked; an option that is not written gets its
/// default.
void resolve_options(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts, UnknownValues& unknown,
                     Diagnostics& diagnostics);

/// Checks the relations between options. A relation is checked only if each of its options could be read. A fault is
/// shown at the last of these options that the file gives.
void check_relations(const WrittenNode& written, const PipelineNode& node, const UnknownValues& unknown,
                     Diagnostics& diagnostics);

/// A note for each option that the pipeline gives without effect. A node can set again what its functions were made
/// with: the levels of a registration, for example, have their own resolution. Such an option of the node replaces the
/// option of the node that made the function (OptionInfo::replaces). Functions reach a node by its wires, also through
/// nodes that take and give functions of one type. `pipeline` has the nodes of `written`, in their order.
std::vector<std::string> notes_of_replaced_options(const WrittenPipeline& written, const Pipeline& pipeline);

}  // namespace marrow
