// SPDX-License-Identifier: Apache-2.0
#pragma once
// Decoders for the compressed pixels of DICOM files. Each throws CodecError unless the data are complete, have exactly
// this size, and have a precision between `bits_stored` and `bits_allocated`. Samples have bits_allocated / 8 bytes.
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
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

/// The segments of a JPEG stream (ITU T.81) up to the coded samples. What the libraries do not check is checked on them
/// before decoding.
class JpegSegments {
 public:
  explicit JpegSegments(std::string_view bytes) : bytes_(bytes) {
    if (bytes.substr(0, 2) != "\xFF\xD8") throw CodecError("the pixels do not begin as JPEG");
  }
  /// Goes to the next segment and returns its marker. `segment` is then its content.
  int next() {
    while (at_ + 1 < bytes_.size() && bytes_[at_] == '\xFF' && bytes_[at_ + 1] == '\xFF') ++at_;  // filling
    if (at_ + 4 > bytes_.size() || bytes_[at_] != '\xFF')
      throw CodecError("a segment of the compressed pixels is damaged");
    const int marker = std::uint8_t(bytes_[at_ + 1]);
    const std::size_t length = std::size_t(std::uint8_t(bytes_[at_ + 2])) << 8 | std::uint8_t(bytes_[at_ + 3]);
    if (marker < 0xC0 || (marker >= 0xD0 && marker <= 0xD9) || length < 2 || length > bytes_.size() - at_ - 2)
      throw CodecError("a segment of the compressed pixels is damaged");
    segment = bytes_.substr(at_ + 4, length - 2);
    at_ += 2 + length;
    return marker;
  }
  int byte(std::size_t at) const {
    if (at >= segment.size()) throw CodecError("a segment of the compressed pixels is too short");
    return std::uint8_t(segment[at]);
  }
  int word(std::size_t at) const { return byte(at) << 8 | byte(at + 1); }
  std::string_view rest() const { return bytes_.substr(at_); }
  std::string_view segment;

 private:
  std::string_view bytes_;
  std::size_t at_ = 2;
};

}  // namespace marrow::files
