// SPDX-License-Identifier: Apache-2.0
#pragma once
// Names of the parts of a pipeline: how they are found, and how messages show them.
#include <algorithm>
#include <string>
#include <vector>

#include "marrow/base/diagnostics.hpp"

namespace MARROW_EXPORT marrow {

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items) {
  std::vector<std::string> names;
  for (const T& item : items) names.push_back(item.name);
  return names;
}

/// The item of this name, or null.
template <class T>
const T* find_named(const std::vector<T>& items, const std::string& name) {
  const auto found = std::find_if(items.begin(), items.end(), [&](const T& item) { return item.name == name; });
  return found == items.end() ? nullptr : &*found;
}

inline bool contains(const std::vector<std::string>& list, const std::string& item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

inline std::string joined(const std::vector<std::string>& list, const char* separator) {
  std::string text;
  for (const std::string& item : list) text += (text.empty() ? "" : separator) + item;
  return text;
}

/// suggestion() as long as `diagnostics` keeps faults, then an empty text: to compare thousands of unknown names with
/// thousands of known ones would take long.
inline std::string suggested(const Diagnostics& diagnostics, const std::string& wrong,
                             const std::vector<std::string>& known) {
  return diagnostics.is_full() ? "" : suggestion(wrong, known);
}

}  // namespace marrow
