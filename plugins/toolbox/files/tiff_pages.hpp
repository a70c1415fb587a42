// SPDX-License-Identifier: Apache-2.0
#pragma once
// The page directories of a TIFF, checked against the file's size.
#include <vector>

#include "marrow/toolbox/files/input_file.hpp"
#include "samples.hpp"

namespace marrow::files {

struct TiffStrip {
  std::uint64_t begin = 0, bytes = 0;
};

struct TiffPage {
  std::uint64_t width = 0, height = 0, bits = 1, samples = 1, compression = 1, photometric = 1, fill_order = 1,
                orientation = 1, rows_per_strip = 0xFFFFFFFF, predictor = 1, format = 1, subfile = 0, planes = 1;
  bool is_tiled = false;
  std::uint64_t told = 0;  ///< number of pages that belong together by its description, from this one on; 0: not given
  std::vector<TiffStrip> strips;
  std::vector<std::uint64_t> palette;  ///< all red values, then all green and all blue ones

  /// Number of samples of a pixel that lie side by side (PlanarConfiguration 2 keeps each colour apart).
  std::uint64_t samples_together() const { return planes == 2 ? 1 : samples; }
  /// Whether both can be pages of one stack.
  bool is_like(const TiffPage& other) const {
    return width == other.width && height == other.height && bits == other.bits && samples == other.samples &&
           photometric == other.photometric && orientation == other.orientation && format == other.format &&
           planes == other.planes && palette == other.palette;
  }
};

struct TiffPages {
  bool big_endian = false;
  std::vector<TiffPage> pages;
  std::string other_pages;          ///< what the pages are, if they are not the slices of one volume; else empty
  double slope = 1, intercept = 0;  ///< value = slope * sample + intercept
};

/// Throws Error if pages are missing at the end of the file, differ in size or kind, or claim more than the file holds.
TiffPages read_tiff_pages(const InputFile& file);

/// Copies the rows of one strip to `to`, decompressed and in the byte order of this machine. Throws Error if the strip
/// does not hold `bytes` bytes.
void read_tiff_strip(const InputFile& file, const TiffPages& tiff, const TiffPage& page, const TiffStrip& strip,
                     std::byte* to, std::size_t bytes);

}  // namespace marrow::files
