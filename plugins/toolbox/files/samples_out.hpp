// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes samples to files, without the domain's types.
#include <array>
#include <filesystem>
#include <string>

namespace marrow::files {

enum class Sample { u8, u16 };

/// Geometry of a grid of samples.
struct GridOut {
  std::array<int, 3> size;
  std::array<double, 3> spacing_mm, origin_mm;
  std::array<std::array<double, 3>, 3> axes;  ///< axes[k]: direction of grid axis k
};
/// Writes a grid of float samples, x fastest, as compressed MHA. Throws Error if it cannot be written.
void write_mha(const std::filesystem::path& path, const GridOut& grid, const float* values);

/// An image as the bytes of a PNG file. Rows from the top, pixels without gaps, one or three channels (RGB) of 8 or 16
/// bits. Throws Error, or std::bad_alloc.
std::string png_of(int width, int height, int channels, Sample sample, const void* pixels);
/// The same as a file. Also throws Error if it cannot be written.
void write_png(const std::filesystem::path& path, int width, int height, int channels, Sample sample,
               const void* pixels);

/// An image of one float channel as TIFF, rows from the top. Throws Error if it is too large for a TIFF (4 GB) or
/// cannot be written.
void write_float_tiff(const std::filesystem::path& path, int width, int height, const float* pixels);

}  // namespace marrow::files
