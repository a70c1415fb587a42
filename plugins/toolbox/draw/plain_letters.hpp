// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow::draw {

/// A text in ASCII, as OpenCV's fonts can draw it: letters of Latin languages lose their marks ("ü" becomes "u", "ß"
/// "ss"), dashes, quotes and a few signs become the nearest ones, and every other character is one question mark.
std::string in_plain_letters(const std::string& text);

}  // namespace marrow::draw
