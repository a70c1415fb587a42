// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// The item of that name along the value's outermost axis. Throws Error with the nearest known names if there is none.
Value picked(const Value& value, const std::string& item, const std::string& reference);

/// The names along an axis, at any level of nested lists; empty if the value has no such axis.
std::vector<std::string> names_along(const Value& value, const std::string& axis);

/// The value at one position along an axis; unchanged if the value has no such axis.
Value sliced(const Value& value, const std::string& axis, std::size_t index);

/// The key of a value, as part of the keys of the nodes that use it. It is the value's own key. For a list, it is made
/// from the axis and from the names and keys of the items.
Digest key_of(const Value& value);

}  // namespace marrow
