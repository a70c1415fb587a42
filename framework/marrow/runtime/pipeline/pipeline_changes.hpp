// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline_layer.hpp"

namespace marrow {

/// The entries of `set` in a file.
std::vector<WrittenEntry> changes_in(const YamlEntry& section, const PipelineLayer& layer);

/// Changes the pipeline. `layer`: the number of the changes' layer; those of a later layer of their own come after it.
/// Options that an override makes useless are worth a note.
void apply_changes(WrittenPipeline& pipeline, std::vector<WrittenEntry> changes, int layer, Diagnostics& diagnostics);

}  // namespace marrow
