// SPDX-License-Identifier: Apache-2.0
#pragma once
// Decoders for the compressed pixels of DICOM files. Each throws CodecError unless the data are complete, have exactly
// this size, and have a precision between `bits_stored` and `bits_allocated`. Samples have bits_allocated / 8 bytes.
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace marrow::files {

struct CodecError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The data may be sound, but are of a kind that is not decoded.
struct CodecNotRead : CodecError {
  using CodecError::CodecError;
};

struct CodedImage {
  std::string bytes;
  int columns = 0, rows = 0, bits_stored = 0, bits_allocated = 0;
};

std::vector<std::byte> decode_rle(const CodedImage& image);
std::vector<std::byte> decode_jpeg_baseline(const CodedImage& image);
/// Process 14 of ITU T.81: any predictor, one component.
std::vector<std::byte> decode_jpeg_lossless(const CodedImage& image);
std::vector<std::byte> decode_jpeg_ls(const CodedImage& image);

}  // namespace marrow::files
