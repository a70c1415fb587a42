// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {

/// Replaces each node that uses a pipeline file by the nodes of that file, called NODE/ITS NODE. Its inputs of data are
/// replaced by what the node is wired to, and what names the node by what makes its outputs. If the pipeline is itself
/// a part that is checked alone, nodes stand for its inputs.
void put_parts_in(WrittenPipeline& pipeline, const PipelineReading& reading, const Catalogue& catalogue,
                  Diagnostics& diagnostics);

}  // namespace marrow
