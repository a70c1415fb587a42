// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pages of a TIFF, as libtiff finds them.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "marrow/toolbox/files/input_file.hpp"

struct tiff;

namespace marrow::files {

struct TiffPage {
  std::uint32_t width = 0, height = 0, rows_per_strip = 0, subfile = 0;
  std::uint16_t bits = 1, samples = 1, compression = 1, photometric = 1, fill_order = 1, orientation = 1, planes = 1,
                format = 1;
  bool is_tiled = false;
  std::uint64_t told = 0;  ///< number of pages that belong together by its description, from this one on; 0: not given
  std::array<std::vector<std::uint16_t>, 3> palette;  ///< red, green and blue

  /// Number of samples of a pixel that lie side by side (PlanarConfiguration 2 keeps each colour apart).
  std::size_t samples_together() const { return planes == 2 ? 1 : samples; }
  /// Whether both can be pages of one stack.
  bool is_like(const TiffPage& other) const {
    return width == other.width && height == other.height && bits == other.bits && samples == other.samples &&
           photometric == other.photometric && orientation == other.orientation && format == other.format &&
           planes == other.planes && palette == other.palette;
  }
};

/// Goes through the pages of a file once. What libtiff warns of is an error here, because it then guesses.
class TiffReader {
 public:
  /// Goes to the first page. Throws Error if the file is no TIFF or has no whole page. The file must outlive it.
  explicit TiffReader(const InputFile& file);
  TiffReader(const TiffReader&) = delete;
  ~TiffReader();

  /// Goes to the next page. False behind the last. Throws Error if the next is damaged.
  bool next();
  TiffPage page() const;
  /// The text of ImageDescription; empty if there is none.
  std::string description() const;
  /// Copies all strips of the page, decompressed and in the byte order of this machine. The rows of a second plane
  /// follow those of the first. Throws Error if a strip does not hold its rows.
  void read_strips(const TiffPage& page, std::byte* to);

 private:
  struct Source;
  void check_pages() const;
  std::unique_ptr<Source> source_;
  tiff* tiff_ = nullptr;
  int pages_ = 0;
};

struct TiffPages {
  std::vector<TiffPage> pages;
  std::string other_pages;          ///< what the pages are, if they are not the slices of one volume; else empty
  double slope = 1, intercept = 0;  ///< value = slope * sample + intercept
};

/// Throws Error if pages are missing at the end of the file, or differ in size or kind.
TiffPages read_tiff_pages(const InputFile& file);

/// What the description field of a TIFF says about the pages of the whole file.
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
