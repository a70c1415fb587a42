// SPDX-License-Identifier: Apache-2.0
#pragma once
// The segments of a JPEG stream (ITU T.81). What the libraries do not check is checked on them before decoding.
#include <cstdint>
#include <string>
#include <string_view>

#include "codecs.hpp"

namespace marrow::files {

/// The segments of a stream up to the coded samples.
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
