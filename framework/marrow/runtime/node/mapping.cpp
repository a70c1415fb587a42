// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/node/mapping.hpp"

#include <algorithm>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/error.hpp"

namespace marrow {

Value picked(const Value& value, const std::string& item, const std::string& reference) {
  if (value.is_absent()) return value;
  const auto found = std::find(value.names.begin(), value.names.end(), item);
  if (found == value.names.end())
    throw Error("'" + reference + "': there is no '" + item + "' along the axis '" + value.axis + "'; " +
                suggestion(item, value.names));
  return value.items[std::size_t(found - value.names.begin())];
}

std::vector<std::string> names_along(const Value& value, const std::string& axis) {
  if (value.axis == axis) return value.names;
  for (const Value& item : value.items) {
    std::vector<std::string> names = names_along(item, axis);
    if (!names.empty()) return names;
  }
  return {};
}

Value sliced(const Value& value, const std::string& axis, std::size_t index) {
  if (!value.is_list()) return value;
  if (value.axis == axis) return value.items.at(index);
  Value result = value;
  for (Value& item : result.items) item = sliced(item, axis, index);
  return result;
}

Digest key_of(const Value& value) {
  if (!value.is_list()) return value.key;
  Hasher hasher;
  hasher.add(value.axis);
  hasher.add(value.names);
  for (const Value& item : value.items) hasher.add(key_of(item));
  return hasher.digest();
}

}  // namespace marrow
