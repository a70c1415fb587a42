// SPDX-License-Identifier: Apache-2.0
#include "domain/exact_number.hpp"

#include <charconv>
#include <cmath>

namespace marrow {

std::string exact_number(double value) {
  char text[32];
  const bool is_whole = value == std::trunc(value) && std::abs(value) < 1e15;
  return {text, is_whole ? std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr
                         : std::to_chars(text, text + sizeof text, value).ptr};
}

}  // namespace marrow
