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

// The characters of a text in UTF-8.

struct Character {
  std::size_t size = 1;  ///< bytes
  char32_t code = 0;
  bool is_valid = false;  ///< well-formed UTF-8: no overlong form, no surrogate, nothing above U+10FFFF
};

/// The first character of a text that is not empty. A byte that is not UTF-8 counts as a character.
Character first_character(std::string_view text);

/// Whether a byte of UTF-8 continues a character.
constexpr bool goes_on(char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; }

/// C0, DEL, C1, line separators, and characters that change the direction of writing.
bool is_control(char32_t code);

/// Whether nothing is drawn for a character: joiners, fillers, selectors, a soft hyphen, a byte order mark.
bool is_unseen(char32_t code);

/// The first character by which a name could differ from another that looks the same, as "U+200B, which cannot be
/// seen"; empty if there is none. These are control characters, characters that are not drawn, blanks other than the
/// space, and combining marks. Unicode can write the same name with such marks (NFD) and without them (NFC).
std::string odd_character_in(std::string_view name);

}  // namespace marrow
