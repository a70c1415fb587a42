// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/hash.hpp"
#include "marrow/runtime/pipeline.hpp"

namespace marrow::compare {

/// Of the states of all files that the pipeline's needed nodes name: another one where any was written to in the
/// meantime.
Digest states_of_files(const Pipeline& pipeline);

}  // namespace marrow::compare
