// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {

/// A note for each option that the pipeline gives although it counts nothing: a node that the option's function reaches
/// has an option that replaces it (OptionInfo::replaces). Functions reach a node by its wires, also through nodes that
/// take and give functions of one type. `pipeline` has the nodes of `written`, in their order.
std::vector<std::string> notes_of_replaced_options(const WrittenPipeline& written, const Pipeline& pipeline);

}  // namespace marrow
