// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "marrow/runtime/node/node.hpp"

namespace marrow {

/// An option's value as JSON.
nlohmann::json json_of(const OptionValue& value);

/// The names of the types of relations, in the order of RelationType.
inline constexpr const char* kRelationTypes[] = {"not_above",   "below",        "same_length", "as_many_or_none",
                                                 "exactly_one", "at_least_one", "distinct"};

}  // namespace marrow
