// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::write {

/// Throws Error, with the file's name, if the pixels are float and one of them is NaN or infinite: no reader takes it.
void check_finite_pixels(const cv::Mat& pixels, const std::filesystem::path& path);

/// Writes pixels unchanged: one or three channels (RGB) of 8 or 16 bits as PNG, one channel of float as TIFF. The
/// extension of `path` is not looked at. Throws Error for an empty image, other pixels, as check_finite_pixels() does,
/// or if it cannot be written.
void write_pixels(const std::filesystem::path& path, const cv::Mat& pixels);

/// Writes the samples of a volume or field as compressed MHA, x fastest, then y, then z. Throws Error if the grid is
/// empty, if the number of values differs from its size, if one of them is NaN or infinite, or if the file cannot be
/// written.
void write_grid(const std::filesystem::path& path, const Grid& grid, const std::vector<float>& values);

}  // namespace marrow::write
