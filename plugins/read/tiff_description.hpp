// SPDX-License-Identifier: Apache-2.0
#pragma once
// What programs write into the description of a TIFF about the pages of the whole file.
#include <string>

namespace marrow::read {

struct TiffDescription {
  std::string other_pages;    ///< where pages are not the slices of one volume: what they are; else empty
  bool is_truncated = false;  ///< the pages are more than the directories tell of
};

/// Of ImageJ ("frames=2"), OME (SizeT="2") and tifffile ({"shape": [2, 5, 16, 12]}); of others it says nothing.
TiffDescription read_tiff_description(const std::string& text);

}  // namespace marrow::read
