// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow::compare {

/// "1 case", "2 cases".
inline std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace marrow::compare
