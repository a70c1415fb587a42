// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// A text that another program wrote, as marrow's readers expect it: UTF-8 without a byte order mark, in lines that end
/// with \n. Lines that end with \r\n, or all with \r alone, are turned into such. A text that begins with UTF-16's byte
/// order mark is converted; half a character in it becomes U+FFFD. To be used for texts only, because a binary file may
/// hold \r anywhere.
std::string plain_text(std::string bytes);

/// Whether the bytes begin with the byte order mark of UTF-16, in either order.
bool begins_as_utf16(const std::string& bytes);

}  // namespace marrow
