// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the description field of a TIFF says about the pages of the whole file.
#include <cstdint>
#include <string>

namespace marrow::files {

struct TiffDescription {
  std::string other_pages;          ///< what the pages are, if they are not the slices of one volume; else empty
  bool is_truncated = false;        ///< there are more pages than directories
  std::uint64_t pages = 0;          ///< number of pages that belong together, from this one on; 0: not given
  std::uint64_t samples = 0;        ///< the same as a number of samples; 0: not given
  std::string calibration;          ///< why samples cannot be turned into values; else empty
  double slope = 1, intercept = 0;  ///< value = slope * sample + intercept
};

/// Understands ImageJ ("frames=2"), OME (SizeT="2") and tifffile ({"shape": [2, 5, 16, 12]}). For any other text all
/// fields keep their defaults.
TiffDescription read_tiff_description(const std::string& text);
TiffDescription read_ome_description(const std::string& text);

}  // namespace marrow::files
