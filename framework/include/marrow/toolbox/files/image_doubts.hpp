// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::files {

/// Whether an image was compressed with loss: a JPEG, or a DICOM file that is or was one.
bool is_lossy_image(const std::filesystem::path& image);

/// Sentences for the user where the file's format gives a reason to doubt the pixels that read_image_file() returns:
/// they were compressed with loss, or the format does not say which row is the upper one. Each begins with the path.
std::vector<std::string> doubts_about_pixels(const std::filesystem::path& image);

}  // namespace marrow::files
