// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/plain_text.hpp"

#include <algorithm>
#include <cstdint>

namespace marrow {
namespace {

void append_utf8(char32_t code, std::string& text) {
  const auto tail = [&](int bits) { text += char(0x80 | (code >> bits & 0x3F)); };
  if (code < 0x80) {
    text += char(code);
  } else if (code < 0x800) {
    text += char(0xC0 | code >> 6);
    tail(0);
  } else if (code < 0x10000) {
    text += char(0xE0 | code >> 12);
    tail(6), tail(0);
  } else {
    text += char(0xF0 | code >> 18);
    tail(12), tail(6), tail(0);
  }
}

/// `bytes` begins with a byte order mark, which is left out.
std::string utf8_of_utf16(const std::string& bytes) {
  const bool big_endian = bytes[0] == '\xFE';
  const std::size_t count = bytes.size() / 2;
  const auto unit = [&](std::size_t i) {
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
    return char32_t(byte(2 * i + (big_endian ? 0 : 1)) << 8 | byte(2 * i + (big_endian ? 1 : 0)));
  };
  const auto is_surrogate = [&](std::size_t i, char32_t first) { return i < count && (unit(i) & 0xFC00) == first; };
  constexpr char32_t kNoCharacter = 0xFFFD;
  std::string text;
  for (std::size_t i = 1; i < count; ++i) {
    if (is_surrogate(i, 0xD800) && is_surrogate(i + 1, 0xDC00)) {
      append_utf8(0x10000 + ((unit(i) & 0x3FF) << 10) + (unit(i + 1) & 0x3FF), text);
      ++i;
    } else {
      append_utf8((unit(i) & 0xF800) == 0xD800 ? kNoCharacter : unit(i), text);
    }
  }
  if (bytes.size() % 2 == 1) append_utf8(kNoCharacter, text);
  return text;
}

/// In place, because a text may be a surface of gigabytes. Several \r before a \n, as some converters leave them,
/// belong to one line end. In a text that has \n, any other \r is not a line end: 3D Slicer on Windows writes some
/// inside of lines.
void unify_line_ends(std::string& text) {
  std::size_t to = text.find('\r');
  if (to == std::string::npos) return;
  if (text.find('\n') == std::string::npos) {
    std::replace(text.begin(), text.end(), '\r', '\n');
    return;
  }
  for (std::size_t from = to; from < text.size(); ++from) {
    if (text[from] == '\n')
      while (to > 0 && text[to - 1] == '\r') --to;
    text[to++] = text[from];
  }
  while (to > 0 && text[to - 1] == '\r') --to;
  text.resize(to);
}

}  // namespace

bool begins_as_utf16(const std::string& bytes) {
  return bytes.starts_with("\xFE\xFF") || bytes.starts_with("\xFF\xFE");
}

std::string plain_text(std::string bytes) {
  if (begins_as_utf16(bytes))
    bytes = utf8_of_utf16(bytes);
  else if (bytes.starts_with("\xEF\xBB\xBF"))
    bytes.erase(0, 3);
  unify_line_ends(bytes);
  return bytes;
}

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) three = three << 8 | (i + k < bytes.size() ? std::uint8_t(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) text += k <= bytes.size() - i ? kDigits[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

}  // namespace marrow
