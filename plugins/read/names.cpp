// SPDX-License-Identifier: Apache-2.0
#include "names.hpp"

#include <cstdint>

#include "marrow/domain/error.hpp"

namespace marrow::read {
namespace {

constexpr std::size_t kLongest = 100;

/// The character that begins at a byte, which then is behind it; -1 where it is no UTF-8.
long next_character(const std::string& text, std::size_t& at) {
  const int lead = std::uint8_t(text[at++]);
  if (lead < 0x80) return lead;
  const int more = lead >= 0xF0 && lead < 0xF5   ? 3
                   : lead >= 0xE0 && lead < 0xF0 ? 2
                   : lead >= 0xC2 && lead < 0xE0 ? 1
                                                 : 0;
  if (more == 0) return -1;
  long value = lead & (0x3F >> more);
  for (int k = 0; k < more; ++k) {
    if (at == text.size() || (std::uint8_t(text[at]) & 0xC0) != 0x80) return -1;
    value = value << 6 | (std::uint8_t(text[at++]) & 0x3F);
  }
  return value;
}

/// Neither controls nor what turns the direction of writing or breaks lines.
bool is_printable(long c) {
  return c >= 0x20 && !(c >= 0x7F && c < 0xA0) && c != 0x061C && !(c >= 0x200B && c <= 0x200F) &&
         !(c >= 0x2028 && c <= 0x202E) && !(c >= 0x2060 && c <= 0x206F) && !(c >= 0xD800 && c <= 0xDFFF) &&
         c != 0xFEFF && c <= 0x10FFFF;
}

}  // namespace

std::string fault_of_name(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.size() > kLongest) return "has " + std::to_string(name.size()) + " bytes; at most 100 are taken";
  for (std::size_t at = 0; at < name.size();)
    if (!is_printable(next_character(name, at))) return "holds a character that cannot be printed";
  return "";
}

void check_name(const std::string& what, const std::string& name) {
  if (const std::string fault = fault_of_name(name); !fault.empty()) {
    std::string shown;
    for (const char c : name.substr(0, 40)) shown += std::uint8_t(c) < 0x20 || std::uint8_t(c) >= 0x7F ? '?' : c;
    throw Error("the name '" + shown + "' of a " + what + " " + fault + "; choose another");
  }
}

}  // namespace marrow::read
