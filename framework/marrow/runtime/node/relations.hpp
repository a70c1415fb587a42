// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <string>

#include <vector>

#include "marrow/runtime/node/node.hpp"

namespace marrow {

/// A relation that a node's options break.
struct BrokenRelation {
  std::string message;
  std::string hint;  ///< may be empty
};

/// Checks a relation of a node's options, given in the order of info.options. Returns nothing if it holds. `is_wired`
/// says whether an input is wired.
std::optional<BrokenRelation> broken(const RelationInfo& relation, const NodeInfo& info,
                                     const std::vector<OptionValue>& options,
                                     const std::function<bool(const std::string&)>& is_wired);

}  // namespace marrow
