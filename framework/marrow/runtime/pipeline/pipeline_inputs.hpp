// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline_layer.hpp"

namespace marrow {

/// Puts what a file declares under `inputs` over what the files below declare.
void put_inputs_over(DeclaredInputs& inputs, const YamlEntry& section, const PipelineLayer& layer,
                     const Catalogue& catalogue);

/// Gives the inputs their values: given ones, else the defaults. Checks them.
void set_inputs(DeclaredInputs& inputs, const PipelineReading& reading, Diagnostics& diagnostics);

/// What the file declares, for those who use the pipeline.
std::vector<PipelineInput> listed_inputs(const DeclaredInputs& inputs);

/// Where a relative path in a value of an input or in an override starts: the folder of the file that it is written in,
/// else the working folder.
std::filesystem::path folder_of(const Place& written);

}  // namespace marrow
