// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {

/// Reports circles of nodes that wait for each other, each with its own nodes only. All written wires count: a wire
/// that a node does not use is used as soon as another node of the kind takes its place. No name need be known but
/// those of the nodes, so circles are found beside all other faults. Two circles that share a node are reported one
/// after the other, when the first is mended.
void check_circles(const WrittenPipeline& written, Diagnostics& diagnostics);

}  // namespace marrow
