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
  bool is_signed = false;
  std::size_t count() const { return std::size_t(columns) * std::size_t(rows); }
};

/// Throws CodecError if the compressed data tell of another size, number of channels or precision than the header.
void check_coded(const CodedImage& image, long long columns, long long rows, int channels, int bits);
/// Samples of one byte as samples of bits_allocated / 8 bytes; others as they are.
std::vector<std::byte> as_allocated(const CodedImage& image, std::vector<std::byte> samples, int bits);

std::vector<std::byte> decode_rle(const CodedImage& image);
/// The process that the transfer syntax names. Of an extended one, which may have 12 bits, the baseline is a part.
enum class JpegProcess { baseline, extended, lossless };
std::vector<std::byte> decode_jpeg(CodedImage image, JpegProcess process);
/// `is_lossless`: as the transfer syntax says.
std::vector<std::byte> decode_jpeg_ls(const CodedImage& image, bool is_lossless);
std::vector<std::byte> decode_jpeg_2000(CodedImage image);

}  // namespace marrow::files
