// SPDX-License-Identifier: Apache-2.0
#pragma once
// Texts from files on their way to a terminal or a log: a name there may hold escape sequences that recolour, erase or
// rename what a person sees, line breaks that forge lines, or megabytes.
#include <string>
#include <string_view>

namespace marrow {

/// The text in one line, with each control character (C0, DEL, C1, line separators, overrides of the writing direction)
/// and each byte that is no UTF-8 written out, as \x1b or \u202e. A text without those stays as it is.
std::string printable(std::string_view text);

/// The same, but line breaks stay; what follows one is indented, so that it does not pass for a line of its own.
std::string printable_lines(std::string_view text);

/// At most `most` bytes: what is longer ends with an ellipsis instead, between two characters.
std::string cut(std::string_view text, std::size_t most = 80);

/// 'text', cut where it is long.
std::string in_quotes(std::string_view text);

}  // namespace marrow
