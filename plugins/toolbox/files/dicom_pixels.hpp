// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pixels of a DICOM file: their description from the header, and single frames decoded.
#include "dicom_header.hpp"
#include "samples.hpp"

namespace marrow::files {

/// A table from stored numbers to values (ModalityLUTSequence, PS3.3 C.11.1.1).
struct DicomTable {
  double first = 0;                    ///< the stored number of the first entry; entries follow in steps of 1
  std::vector<std::uint16_t> entries;  ///< numbers before the first or behind the last have its value
  int bits = 16;
  std::string type;  ///< of the values: HU, OD, US (unspecified), or as the maker says
  double value_of(double stored) const;
  bool descends() const { return entries.front() > entries.back(); }
};

/// All that decoding needs, without an open file: a series has more files than may be open at once.
struct DicomPixels {
  std::filesystem::path path;
  std::uint64_t file_bytes = 0;
  std::string transfer_syntax;
  bool big_endian = false;
  int columns = 0, rows = 0, frames = 1;
  int channels = 1;               ///< more than one for colours
  bool is_plain_rgb = false;      ///< red, green and blue without compression: the only colours that are decoded
  bool planes_are_apart = false;  ///< all red samples, then all green and all blue ones (PlanarConfiguration)
  int bits_allocated = 16, bits_stored = 16;
  bool is_signed = false;
  double slope = 1, intercept = 0;
  bool gives_slope = false, gives_intercept = false;
  /// Lowest and highest stored value of pixels that were not measured (PixelPaddingValue).
  std::optional<std::array<double, 2>> padding;
  std::optional<std::uint16_t> padding_beyond_bits;  ///< PixelPaddingValue, if the stored bits cannot hold it
  std::optional<DicomTable> table;                   ///< in place of slope and intercept
  std::shared_ptr<const std::string> unpacked;       ///< the content of a deflated file; else null
  bool bytes_are_swapped = false;                    ///< pixels of one byte, written in pairs with the second one first
  std::vector<DicomSpan> frame_parts;                ///< plain pixels: one part with all frames
  std::vector<std::size_t> first_part_of_frame;  ///< for compressed pixels; has one entry more than there are frames
};

/// Takes the values that the header gives for this frame (from 1). Throws Error if the header contradicts itself or the
/// file.
DicomPixels read_dicom_pixels(const std::filesystem::path& path, int frame);
DicomPixels read_dicom_pixels(const DicomFile& file, int frame);

/// One frame (from 1) of grey levels or plain RGB as unsigned or signed integers. Only the stored bits (BitsStored) are
/// kept. Throws Error if the pixels are damaged or the file has changed.
Samples read_dicom_frame(const DicomPixels& pixels, int frame);

/// Sets pixels that were not measured to air (-1000 HU), unless they are below it. `values` come from scaled_values().
void make_padding_air(const DicomPixels& pixels, float* values, std::size_t count);

/// The sum of the lowest and the highest value that the stored bits can hold, after scaling: with 12 bits from 0 to
/// 4095 that is 4095.
double sum_of_limits(const DicomPixels& pixels);

/// The values for the stored numbers, by the table or by RescaleSlope and RescaleIntercept.
void scaled_values(const DicomPixels& pixels, const Samples& samples, float* values);

}  // namespace marrow::files
