// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// Reads and checks a pipeline as read_pipeline() does, for a caller that tries many changes of one file and wants to
/// know what is wrong with each, but not what to do about it: no hint names nodes that would fit, because finding them
/// means to check the pipeline with each other node. Inputs without a default may have no value.
Pipeline try_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments, const Catalogue& catalogue,
                      Diagnostics& diagnostics);

}  // namespace marrow
