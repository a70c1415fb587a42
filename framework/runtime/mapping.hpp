// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/runtime/value.hpp"

namespace marrow {

/// The item of that name along the value's outermost axis. Throws Error naming the ones there are.
Value picked(const Value& value, const std::string& item, const std::string& reference);

/// The names along an axis, wherever in the nest it is; empty where the value has no such axis.
std::vector<std::string> names_along(const Value& value, const std::string& axis);

/// The value with one position taken along an axis; unchanged where it has no such axis.
Value sliced(const Value& value, const std::string& axis, std::size_t index);

/// What identifies a value for the key of what uses it: its own key, or the keys and names of its items.
Digest key_of(const Value& value);

}  // namespace marrow
