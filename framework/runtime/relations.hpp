// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "marrow/runtime/node.hpp"

namespace marrow {

/// A relation that a node's options break.
struct BrokenRelation {
  std::string message;
  std::string hint;  ///< may be empty
};

/// Checks a relation. Returns nothing if it holds. `value` returns the value of an option; `is_wired` says whether an
/// input is wired.
std::optional<BrokenRelation> broken(const RelationInfo& relation, const std::string& node,
                                     const std::function<const OptionValue*(const std::string&)>& value,
                                     const std::function<bool(const std::string&)>& is_wired);

}  // namespace marrow
