// SPDX-License-Identifier: Apache-2.0
#pragma once
// What programs write into the description of a TIFF about the pages of the whole file.
#include <cstdint>
#include <string>

namespace marrow::files {

struct TiffDescription {
  std::string other_pages;          ///< where pages are not the slices of one volume: what they are; else empty
  bool is_truncated = false;        ///< the pages are more than the directories tell of
  std::uint64_t pages = 0;          ///< that belong together, of which this is the first; 0 = it does not say
  std::uint64_t samples = 0;        ///< the same in samples, where it tells of those
  std::string calibration;          ///< why values cannot be had from the samples; else empty
  double slope = 1, intercept = 0;  ///< what makes values of the samples
};

/// Of ImageJ ("frames=2"), OME (SizeT="2") and tifffile ({"shape": [2, 5, 16, 12]}); of others it says nothing.
TiffDescription read_tiff_description(const std::string& text);
TiffDescription read_ome_description(const std::string& text);

}  // namespace marrow::files
