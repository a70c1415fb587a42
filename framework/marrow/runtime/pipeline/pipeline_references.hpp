// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// The ids of nodes, and the ids that references have named so far.
struct NodeIds {
  std::vector<std::string> all;
  std::map<std::string, std::size_t> index;  ///< the index of each node, by its id
  std::set<std::string> used;                ///< named by references
  std::set<std::string> unknown;             ///< named by references, but no node has this id
};

/// Looks up node, node.output, node.item or node.output.item. `types` are the wanted types, or null if they are not
/// known. A node's id alone means its only output, or its only output of a wanted type.
Reference resolve_reference(const std::string& text, const Place& place, const std::vector<TypeInfo>* types,
                            const std::vector<PipelineNode>& nodes, NodeIds& ids, Diagnostics& diagnostics);

bool has_id(const std::vector<TypeInfo>& types, const std::string& id);

}  // namespace marrow
