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

/// Nothing where the relation holds. `value` gives an option's value; `is_wired` tells of an input.
std::optional<BrokenRelation> broken(const RelationInfo& relation, const std::string& node,
                                     const std::function<const OptionValue*(const std::string&)>& value,
                                     const std::function<bool(const std::string&)>& is_wired);

}  // namespace marrow
