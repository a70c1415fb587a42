// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/runtime/kind.hpp"
#include "marrow/runtime/node.hpp"

namespace marrow {

/// What is wrong with a node by the contract of its kind, a sentence each. `kind` is null where no library brings it:
/// its nodes then choose their ports freely, but are not given the truth. A kind without outputs leaves the ports to
/// its nodes, too. Inputs and outputs that the kind does not have are allowed.
std::vector<std::string> contract_faults(const NodeInfo& node, const KindInfo* kind);

/// "view", "list of view over view", "outline_projector or radiograph_projector".
std::string types_text(const std::vector<TypeInfo>& types, const std::string& axis);

}  // namespace marrow
