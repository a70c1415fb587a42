// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pixels of a DICOM file: what its header says of them, and one frame decoded.
#include "dicom_header.hpp"
#include "samples.hpp"

namespace marrow::files {

/// All that decoding needs, without the file being open: a series has more files than may be open at once.
struct DicomPixels {
  std::filesystem::path path;
  std::uint64_t file_bytes = 0;
  std::string transfer_syntax;
  bool big_endian = false;
  int columns = 0, rows = 0, frames = 1;
  int channels = 1;  ///< more than one: colours, which are not decoded
  int bits_allocated = 16, bits_stored = 16;
  bool is_signed = false;
  double slope = 1, intercept = 0;
  bool gives_slope = false, gives_intercept = false;
  /// Stored values, lowest and highest, of pixels that were not measured (PixelPaddingValue).
  std::optional<std::array<double, 2>> padding;
  std::optional<std::uint16_t> padding_beyond_bits;  ///< that value, where the bits that count cannot hold it
  bool has_table = false;                        ///< values go through a table (ModalityLUTSequence), which is not read
  std::vector<DicomSpan> frame_parts;            ///< of plain pixels: one part, all frames
  std::vector<std::size_t> first_part_of_frame;  ///< of compressed ones; one more than there are frames
};

/// With the values that the header gives for this frame (from 1). Throws Error where the header contradicts itself or
/// the file.
DicomPixels read_dicom_pixels(const std::filesystem::path& path, int frame);
DicomPixels read_dicom_pixels(const DicomFile& file, int frame);

/// One frame (from 1) as unsigned or signed integers, of which only the bits that count are kept. Throws Error.
Samples read_dicom_frame(const DicomPixels& pixels, int frame);

/// Values of pixels that were not measured are made air's, unless they are that already. `values` come from
/// scaled_values().
void make_padding_air(const DicomPixels& pixels, float* values, std::size_t count);

/// The values that stored ones stand for (RescaleSlope, RescaleIntercept).
void scaled_values(const DicomPixels& pixels, const Samples& samples, float* values);

}  // namespace marrow::files
