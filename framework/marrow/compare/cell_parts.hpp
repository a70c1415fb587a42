// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the files of CellRunner share.
#include <string>

#include "marrow/base/hash.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace marrow::compare {

inline const std::string kChanged = "a file that the cell needs was changed while it ran; run it again";

/// The reason of the first node that failed, in the pipeline's order.
std::string reason_of(const Pipeline& pipeline, const RunResult& result);

/// Digest of the states of all files that the pipeline's needed nodes name. It changes if any of them is written to.
Digest states_of_files(const Pipeline& pipeline);

}  // namespace marrow::compare
