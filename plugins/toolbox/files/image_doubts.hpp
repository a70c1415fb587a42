// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/runtime/node/context.hpp"

namespace marrow::files {

/// Whether an image was compressed with loss: it is a JPEG, or a DICOM file whose pixels are or were one.
bool is_lossy_image(const std::filesystem::path& image);

/// Warns where the file's format gives a reason to doubt the pixels that read_image_file() returns: they were
/// compressed with loss, or the format does not say which row is the upper one. Each warning begins with the path.
void warn_of_pixels(const std::filesystem::path& image, const Context& context);

}  // namespace marrow::files
