// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/kind.hpp"
#include "marrow/runtime/node/node.hpp"

namespace MARROW_EXPORT marrow {

/// What breaks the contract of the node's kind, one sentence each. `kind` is null if no library declares the kind: its
/// nodes may then have any ports, but are not given the truth. A kind without outputs leaves the outputs to its nodes.
/// A node may have inputs and outputs that its kind does not have.
std::vector<std::string> contract_faults(const NodeInfo& node, const KindInfo* kind);

/// Types as a text: "view", "list of view over view", "outline_projector or radiograph_projector".
std::string types_text(const std::vector<TypeInfo>& types, const std::string& axis);

}  // namespace marrow
