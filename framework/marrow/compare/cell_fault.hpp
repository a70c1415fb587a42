// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/runtime/run/executor.hpp"

namespace marrow::compare {

inline const std::string kChanged = "a file that the cell needs was changed while it ran; run it again";

/// The reason of the first node that failed, in the pipeline's order.
std::string reason_of(const Pipeline& pipeline, const RunResult& result);

}  // namespace marrow::compare
