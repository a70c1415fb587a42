// SPDX-License-Identifier: Apache-2.0
#pragma once
// The directories of a TIFF, as its page says them, held against the file.
#include <vector>

#include "marrow/toolbox/files/input_file.hpp"
#include "samples.hpp"

namespace marrow::files {

struct TiffStrip {
  std::uint64_t begin = 0, bytes = 0;
};

struct TiffPage {
  std::uint64_t width = 0, height = 0, bits = 1, samples = 1, compression = 1, photometric = 1, fill_order = 1,
                orientation = 1, rows_per_strip = 0xFFFFFFFF, predictor = 1, format = 1, subfile = 0;
  bool is_tiled = false;
  std::uint64_t told = 0;  ///< pages that belong together by its description, of which it is the first; 0 = not said
  std::vector<TiffStrip> strips;

  /// Whether both are pages of one stack.
  bool is_like(const TiffPage& other) const {
    return width == other.width && height == other.height && bits == other.bits && samples == other.samples &&
           photometric == other.photometric && orientation == other.orientation && format == other.format;
  }
};

struct TiffPages {
  bool big_endian = false;
  std::vector<TiffPage> pages;
  std::string other_pages;          ///< where pages are not the slices of one volume: what they are
  double slope = 1, intercept = 0;  ///< what makes values of the samples
};

/// Throws Error when pages are missing at the file's end, differ in size, or claim more than the file holds.
TiffPages read_tiff_pages(const InputFile& file);

/// The rows of one strip, unpacked and in the byte order of this machine, into `to`. Throws Error unless there are
/// exactly `bytes`.
void read_tiff_strip(const InputFile& file, const TiffPages& tiff, const TiffPage& page, const TiffStrip& strip,
                     std::byte* to, std::size_t bytes);

}  // namespace marrow::files
