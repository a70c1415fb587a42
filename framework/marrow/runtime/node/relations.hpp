// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>
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

/// An option's value as JSON.
nlohmann::json json_of(const OptionValue& value);

/// The names of the types of relations, in the order of RelationType.
inline constexpr const char* kRelationTypes[] = {"not_above",   "below",        "same_length", "as_many_or_none",
                                                 "exactly_one", "at_least_one", "distinct"};

}  // namespace marrow
