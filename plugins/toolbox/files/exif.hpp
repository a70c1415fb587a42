// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

namespace marrow::files {

/// Throws Error, beginning with `what`, if Exif data (as PNG and JPEG hold them) say that the image is to be shown
/// turned or mirrored. Image viewers would turn it, but the readers here do not.
void check_not_turned(const std::string& what, std::string_view exif);

}  // namespace marrow::files
