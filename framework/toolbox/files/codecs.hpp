// SPDX-License-Identifier: Apache-2.0
#pragma once
// Decoders of the compressed pixels that DICOM files hold. Each throws CodecError unless the data are whole and of just
// this size, with a precision of at least `bits_stored` and at most `bits_allocated`; samples have as many bytes as
// `bits_allocated` takes.
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace marrow::files {

struct CodecError : std::runtime_error {
  using std::runtime_error::runtime_error;
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
