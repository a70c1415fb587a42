// SPDX-License-Identifier: Apache-2.0
#pragma once
// Names in the messages about a pipeline.
#include <algorithm>
#include <string>
#include <vector>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/export.hpp"
#include "marrow/base/names.hpp"

namespace MARROW_EXPORT marrow {

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items) {
  std::vector<std::string> names;
  for (const T& item : items) names.push_back(item.name);
  return names;
}

inline bool contains(const std::vector<std::string>& list, const std::string& item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

inline std::string joined(const std::vector<std::string>& list, const char* separator) {
  std::string text;
  for (const std::string& item : list) text += (text.empty() ? "" : separator) + item;
  return text;
}

/// A suggestion, as long as faults are kept; then an empty text. Thousands of unknown names among thousands of known
/// ones would take long.
inline std::string suggested(const Diagnostics& diagnostics, const std::string& wrong,
                             const std::vector<std::string>& known) {
  return diagnostics.is_full() ? "" : suggestion(wrong, known);
}

}  // namespace marrow
