// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks of what a library declares, when it registers.
#include "marrow/runtime/node/kind.hpp"
#include "marrow/runtime/node/node.hpp"

namespace marrow::detail {

/// Checks the declaration itself and fills `faults`. It does not check the contract of the kind.
void check_declaration(NodeDefinition& node);

}  // namespace marrow::detail
