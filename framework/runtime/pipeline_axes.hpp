// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/diagnostics.hpp"
#include "marrow/runtime/pipeline.hpp"

namespace marrow {

/// Sorts the nodes so that sources come before users, in the file's order otherwise, and finds the axes along which
/// each is called. Needs a pipeline whose references are all resolved.
void order_and_find_axes(Pipeline& pipeline, Diagnostics& diagnostics);

}  // namespace marrow
