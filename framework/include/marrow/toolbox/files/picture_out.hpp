// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/image.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::files {

/// One- or three-channel pixels as they are: PNG of 8 or 16 bits, TIFF for float. Throws Error.
void write_pixels(const std::filesystem::path& path, const cv::Mat& pixels);

/// A volume's or field's samples as compressed MHA. Throws Error.
void write_grid(const std::filesystem::path& path, const Grid& grid, const std::vector<float>& values);

}  // namespace marrow::files
