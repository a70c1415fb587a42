// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// The nodes' ids, and which of them references have named so far.
struct NodeIds {
  std::vector<std::string> all;
  std::map<std::string, std::size_t> index;  ///< the index of each node, by its id
  std::set<std::string> used, unknown;       ///< ids that references have named
};

/// Looks up node, node.output, node.item or node.output.item. `types` are the wanted types, if they are known: a node's
/// name alone then means its only output of one of these types.
Reference resolve_reference(const std::string& text, const Place& place, const std::vector<TypeInfo>* types,
                            const std::vector<PipelineNode>& nodes, NodeIds& ids, Diagnostics& diagnostics);

bool has_id(const std::vector<TypeInfo>& types, const std::string& id);

}  // namespace marrow
