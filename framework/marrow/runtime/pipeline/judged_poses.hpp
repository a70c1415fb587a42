// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which poses of a pipeline somebody judges. A pose that nobody judged must not look like one that was.
#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {

/// Leaves only the outputs of these names, and the verdicts on all poses that are made for them: a part of a pipeline
/// tells no less about its poses than the whole. Throws Error for a name that the pipeline does not have.
void keep_outputs(Pipeline& pipeline, const std::vector<std::string>& names);

/// A sentence for each output that is a pose on which the pipeline has no verdict. A verdict also counts if it is on
/// the pose that the output was made from, as after a change of its deviations, unless a cost led to another place.
std::vector<std::string> notes_on_poses(const Pipeline& pipeline);

}  // namespace marrow
