// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which poses of a pipeline get a verdict. A pose without one must not look like a judged pose.
#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {

/// Keeps only the outputs of these names, and the verdicts on all poses that are made for them. So a part of a pipeline
/// tells as much about its poses as the whole. Throws Error if the pipeline has no output of a name.
void keep_outputs(Pipeline& pipeline, const std::vector<std::string>& names);

/// A sentence for each output that is a pose without a verdict. A verdict on an earlier pose also counts, if the output
/// was made from that pose and no node in between has a cost. So new deviations keep the verdict; a new search does
/// not.
std::vector<std::string> notes_on_poses(const Pipeline& pipeline);

}  // namespace marrow
