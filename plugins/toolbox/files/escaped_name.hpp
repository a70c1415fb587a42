// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <charconv>
#include <string>

namespace marrow::files {

/// The name of an item from that of its file, in which some characters are written as in web addresses: "a%2Fb" is a/b.
inline std::string unescaped_name(const std::string& file_name) {
  std::string name;
  for (std::size_t i = 0; i < file_name.size(); ++i) {
    unsigned byte = 0;
    const char* code = file_name.data() + i + 1;
    const bool is_code =
        file_name[i] == '%' && i + 2 < file_name.size() && std::from_chars(code, code + 2, byte, 16).ptr == code + 2;
    name += is_code ? char(byte) : file_name[i];
    if (is_code) i += 2;
  }
  return name;
}

}  // namespace marrow::files
