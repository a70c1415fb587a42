// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/diagnostics.hpp"

namespace marrow {

/// The hint for an option or port that the node does not have: what it is called now, if it had this name before; else
/// suggested(). A folder of plugins lists such names in its file renamed.txt. A line holds the version since which the
/// new name holds, the node or its kind, the old name and the new name.
std::string suggested_for(const std::string& node, const std::string& wrong, const std::vector<std::string>& known,
                          const Diagnostics& diagnostics);

}  // namespace marrow
