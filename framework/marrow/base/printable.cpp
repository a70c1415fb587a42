// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/printable.hpp"

#include "marrow/base/characters.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

std::string printable(std::string_view text, const char* after_line_break) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const Character character = first_character(text);
    if (text[0] == '\n' && after_line_break) {
      result += '\n';
      if (text.size() > 1) result += after_line_break;
    } else if (!character.is_valid || (is_control(character.code) && character.size == 1)) {
      result += formatted("\\x{:02x}", static_cast<unsigned char>(text[0]));
    } else if (is_control(character.code) || is_unseen(character.code)) {
      const auto code = std::uint32_t(character.code);
      result += code > 0xFFFF ? formatted("\\U{:08x}", code) : formatted("\\u{:04x}", code);
    } else {
      result += text.substr(0, character.size);
    }
    text.remove_prefix(character.size);
  }
  return result;
}

}  // namespace

std::string printable(std::string_view text) { return printable(text, nullptr); }

std::string printable_lines(std::string_view text) { return printable(text, "  "); }

std::string cut(std::string_view text, std::size_t most) {
  if (text.size() <= most) return std::string(text);
  std::size_t end = most - 3;  // the ellipsis has three bytes
  while (end > 0 && goes_on(text[end])) --end;
  return std::string(text.substr(0, end)) + "\u2026";
}

std::string in_quotes(std::string_view text) { return "'" + cut(text) + "'"; }

}  // namespace marrow
