// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/hash.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow::compare {

/// Digest of the states of all files that the pipeline's needed nodes name. It changes if any of them is written to.
Digest states_of_files(const Pipeline& pipeline);

}  // namespace marrow::compare
