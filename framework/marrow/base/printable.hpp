// SPDX-License-Identifier: Apache-2.0
#pragma once
// Makes texts from files safe to show on a terminal or in a log. Such a text may hold escape sequences that recolour,
// erase or rename what a person sees, line breaks that forge lines, or megabytes.
#include <string>
#include <string_view>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The text in one line. Each control character (C0, DEL, C1, line separators, overrides of the writing direction),
/// each character that is not drawn (such as a zero width space) and each byte that is not UTF-8 is written as an
/// escape such as \x1b or \u202e. Everything else stays as it is.
std::string printable(std::string_view text);

/// The same, but line breaks stay. The text after a line break is indented, so that it cannot look like a line of its
/// own.
std::string printable_lines(std::string_view text);

/// The text, cut to at most `most` bytes. A text that was cut ends with an ellipsis. No character is cut in two.
std::string cut(std::string_view text, std::size_t most = 80);

/// The text in single quotes, shortened by cut().
std::string in_quotes(std::string_view text);

}  // namespace marrow
