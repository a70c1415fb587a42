// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

struct Unclosed {
  char mark;  ///< { [ " or '
  int line;   ///< 1-based
  int column;
};

/// The innermost bracket or quote of a YAML text that is opened but not closed, or that is closed by another kind of
/// bracket.
std::optional<Unclosed> last_unclosed(const std::string& text);

}  // namespace marrow
