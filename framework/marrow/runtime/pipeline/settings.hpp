// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {

/// Adds what a file of settings says, with the keys `inputs` and `set`, to the arguments of a pipeline. Its overrides
/// are a layer above those that are there.
void add_settings(const std::filesystem::path& file, PipelineArguments& arguments, Diagnostics& diagnostics);

}  // namespace marrow
