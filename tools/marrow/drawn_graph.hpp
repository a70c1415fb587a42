// SPDX-License-Identifier: Apache-2.0
#pragma once
// A pipeline as a drawing: bodies are drawn beside the nodes that run them.
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow::cli {

struct DrawnNode {
  std::string id;    ///< of a node of a body: "node/node of the body"
  std::string body;  ///< the node whose body it is in; empty outside of bodies
  const PipelineNode* node = nullptr;
  bool is_needed = true;  ///< it feeds an output
};

struct DrawnEdge {
  std::string from, to, port;
  bool is_function = false;
  bool is_of_pass_before = false;  ///< it hands on what the pass before made
};

struct DrawnGraph {
  std::vector<DrawnNode> nodes;
  std::vector<DrawnEdge> edges;
};

/// With `only_needed`, nodes that feed no output are left out. The pipeline must outlive the result.
DrawnGraph drawn_graph(const Pipeline& pipeline, bool only_needed);

/// How a body is run, in words: "each frame in turn", "at most 8 passes, until done".
std::string passes_text(const Repetition& repetition);

}  // namespace marrow::cli
