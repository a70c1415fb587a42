// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/printable.hpp"

#include <algorithm>
#include <iterator>

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

struct CodeRange {
  char32_t first, last;
};

template <std::size_t count>
bool is_in_one_of(const CodeRange (&ranges)[count], char32_t code) {
  return std::any_of(std::begin(ranges), std::end(ranges),
                     [&](const CodeRange& range) { return code >= range.first && code <= range.last; });
}

bool is_blank_but_not_a_space(char32_t code) {
  static constexpr CodeRange kBlanks[] = {{0x00A0, 0x00A0}, {0x1680, 0x1680}, {0x2000, 0x200A}, {0x202F, 0x202F},
                                          {0x205F, 0x205F}, {0x2800, 0x2800}, {0x3000, 0x3000}};
  return is_in_one_of(kBlanks, code);
}

/// Marks that the form NFD writes apart from their letters: of alphabets, kana and Hangul.
bool is_mark_of_a_letter(char32_t code) {
  static constexpr CodeRange kMarks[] = {{0x0300, 0x036F}, {0x0483, 0x0489}, {0x1161, 0x11FF}, {0x1AB0, 0x1AFF},
                                         {0x1DC0, 0x1DFF}, {0x20D0, 0x20FF}, {0x3099, 0x309A}, {0xFE20, 0xFE2F}};
  return is_in_one_of(kMarks, code);
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

Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return {1, byte(0), true};
  const std::size_t size = byte(0) >= 0xF0 ? 4 : byte(0) >= 0xE0 ? 3 : 2;
  if (byte(0) < 0xC2 || byte(0) > 0xF4 || text.size() < size) return {};
  char32_t code = byte(0) & (0xFF >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    if (!goes_on(text[i])) return {};
    code = (code << 6) | (byte(i) & 0x3F);
  }
  static constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[size] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {size, code, true};
}

bool is_control(char32_t code) {
  static constexpr CodeRange kControls[] = {{0x00, 0x1F},     {0x7F, 0x9F},     {0x061C, 0x061C},
                                            {0x200E, 0x200F}, {0x2028, 0x202E}, {0x2066, 0x2069}};
  return is_in_one_of(kControls, code);
}

bool is_unseen(char32_t code) {
  static constexpr CodeRange kUnseen[] = {{0x00AD, 0x00AD}, {0x034F, 0x034F},   {0x115F, 0x1160},  {0x17B4, 0x17B5},
                                          {0x180B, 0x180F}, {0x200B, 0x200D},   {0x2060, 0x2065},  {0x206A, 0x206F},
                                          {0x3164, 0x3164}, {0xFE00, 0xFE0F},   {0xFEFF, 0xFEFF},  {0xFFA0, 0xFFA0},
                                          {0xFFF0, 0xFFFB}, {0x1D173, 0x1D17A}, {0xE0000, 0xE0FFF}};
  return is_in_one_of(kUnseen, code);
}

std::string odd_character_in(std::string_view name) {
  while (!name.empty()) {
    const Character character = first_character(name);
    const std::string code = formatted("U+{:04X}", std::uint32_t(character.code));
    if (!character.is_valid) return "bytes that are not UTF-8";
    if (is_control(character.code)) return "a control character";
    if (is_unseen(character.code)) return code + ", which cannot be seen";
    if (is_blank_but_not_a_space(character.code)) return code + ", a blank that is not a space";
    if (is_mark_of_a_letter(character.code))
      return code + ", a mark of the letter before it; type the letter with its mark as one character";
    name.remove_prefix(character.size);
  }
  return "";
}

}  // namespace marrow
