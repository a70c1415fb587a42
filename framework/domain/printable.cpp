// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/printable.hpp"

#include <cstdio>

namespace marrow {
namespace {

struct Character {
  std::size_t size = 1;  ///< bytes
  char32_t code = 0;
  bool is_valid = false;  ///< well-formed UTF-8: no overlong form, no surrogate, nothing above U+10FFFF
};

Character first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return {1, byte(0), true};
  const std::size_t size = byte(0) >= 0xF0 ? 4 : byte(0) >= 0xE0 ? 3 : 2;
  if (byte(0) < 0xC2 || byte(0) > 0xF4 || text.size() < size) return {};
  char32_t code = byte(0) & (0xFF >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {};
    code = (code << 6) | (byte(i) & 0x3F);
  }
  static constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[size] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {size, code, true};
}

bool is_control(char32_t code) {
  const auto within = [&](char32_t first, char32_t last) { return code >= first && code <= last; };
  return code < 0x20 || within(0x7F, 0x9F) || code == 0x061C || within(0x200E, 0x200F) || within(0x2028, 0x202E) ||
         within(0x2066, 0x2069);
}

std::string printable(std::string_view text, const char* after_line_break) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const Character character = first_of(text);
    char written[16] = "";
    if (text[0] == '\n' && after_line_break) {
      result += '\n';
      if (text.size() > 1) result += after_line_break;
    } else if (!character.is_valid || (is_control(character.code) && character.size == 1)) {
      std::snprintf(written, sizeof written, "\\x%02x", static_cast<unsigned char>(text[0]));
    } else if (is_control(character.code)) {
      std::snprintf(written, sizeof written, "\\u%04x", unsigned(character.code));
    } else {
      result += text.substr(0, character.size);
    }
    result += written;
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
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return std::string(text.substr(0, end)) + "\u2026";
}

std::string in_quotes(std::string_view text) { return "'" + cut(text) + "'"; }

}  // namespace marrow
