// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/diagnostics.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// Sorts the nodes so that sources come before users, else in the order of the file. Then finds the axes along which
/// each node is called. All references must be resolved, and no nodes may wait for each other (check_circles()).
void order_and_find_axes(Pipeline& pipeline, Diagnostics& diagnostics);

}  // namespace marrow
