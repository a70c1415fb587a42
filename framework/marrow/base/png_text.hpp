// SPDX-License-Identifier: Apache-2.0
#pragma once
// Texts in a PNG file, as its iTXt chunks hold them (PNG 1.2, 4.2.3.3). The pixels are not touched.
#include <optional>
#include <string>
#include <string_view>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Whether the bytes begin as a PNG file does.
bool is_png(std::string_view bytes);

/// The PNG file with this text after its header, and without any other text of this keyword. `text` is UTF-8; `keyword`
/// has 1 to 79 printable characters of ASCII. All other chunks keep their bytes. Throws Error if `png` is no PNG file,
/// or is damaged.
std::string with_png_text(std::string_view png, std::string_view keyword, std::string_view text);

/// The PNG file without any text of this keyword. Throws Error as with_png_text() does.
std::string without_png_text(std::string_view png, std::string_view keyword);

/// The text of this keyword; nothing if there is none. Throws Error as with_png_text() does, also if another program
/// has compressed the text.
std::optional<std::string> png_text(std::string_view png, std::string_view keyword);

}  // namespace marrow
