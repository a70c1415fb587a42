// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Converts a text of another program to the form that marrow's readers expect: UTF-8 without a byte order mark, in
/// lines that end with \n. Line ends \r\n become \n. So does \r if the text has no \n. A text with UTF-16's byte order
/// mark is converted; half a character in it becomes U+FFFD. Use it only for texts: a binary file may hold \r anywhere.
std::string plain_text(std::string bytes);

/// Whether the bytes begin with the byte order mark of UTF-16, in either order.
bool begins_as_utf16(const std::string& bytes);

/// Encodes bytes as base64 text (RFC 4648, with padding).
std::string base64(std::string_view bytes);

}  // namespace marrow
