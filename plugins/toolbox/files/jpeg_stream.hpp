// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of JPEG (ITU T.81) and JPEG-LS (T.87): segments with markers, and bits with stuffing.
#include <cstdint>
#include <string>
#include <string_view>

#include "codecs.hpp"
#include "marrow/base/number_text.hpp"

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

/// The precision from a frame header. Throws CodecError if the header contradicts the image.
inline int frame_precision(const JpegSegments& segments, const CodedImage& image) {
  const int precision = segments.byte(0), rows = segments.word(1), columns = segments.word(3),
            components = segments.byte(5);
  if (rows != image.rows || columns != image.columns)
    throw CodecError(formatted("the compressed pixels are of {} x {}, the header says {} x {}", columns, rows,
                               image.columns, image.rows));
  if (components != 1)
    throw CodecError(formatted("the compressed pixels have {} values each, the header says 1", components));
  if (precision < image.bits_stored || precision > image.bits_allocated || precision < 2)
    throw CodecError(formatted("the compressed pixels have {} bits, the header says {} of {}", precision,
                               image.bits_stored, image.bits_allocated));
  return precision;
}

/// Reads bits, the highest first. After a byte FF, the next `kStuffed` bits are stuffing: a whole byte in JPEG, one bit
/// in JPEG-LS.
template <int kStuffed>
class JpegBits {
 public:
  explicit JpegBits(std::string_view bytes) : bytes_(bytes) {}

  /// The next 16 bits without taking them. Zeros after the end of the data.
  unsigned peek16() {
    fill();
    return held_ >= 16 ? unsigned(bits_ >> (held_ - 16)) & 0xFFFF : unsigned(bits_ << (16 - held_)) & 0xFFFF;
  }
  void skip(int count) {
    if (count > held_) throw CodecError("the compressed pixels end too early");
    held_ -= count;
  }
  /// Takes the next `count` bits, at most 16.
  unsigned take(int count) {
    if (count == 0) return 0;
    const unsigned value = peek16() >> (16 - count);
    skip(count);
    return value;
  }
  /// Skips the rest of the current byte and the marker that must follow. Returns the marker's second byte.
  int marker() {
    fill();
    if (held_ >= 8 || at_ + 2 > bytes_.size() || bytes_[at_] != '\xFF')
      throw CodecError("the compressed pixels go on where they should end");
    while (at_ + 2 < bytes_.size() && bytes_[at_ + 1] == '\xFF') ++at_;
    held_ = 0;
    before_ff_ = false;
    at_ += 2;
    return std::uint8_t(bytes_[at_ - 1]);
  }

 private:
  void fill() {
    while (held_ <= 40 && at_ < bytes_.size()) {
      const int byte = std::uint8_t(bytes_[at_]);
      int width = 8;
      if constexpr (kStuffed == 8) {
        if (byte == 0xFF) {
          if (at_ + 1 >= bytes_.size() || bytes_[at_ + 1] != 0) return;  // a marker
          ++at_;
        }
      } else {
        if (byte == 0xFF && (at_ + 1 >= bytes_.size() || std::uint8_t(bytes_[at_ + 1]) >= 0x80)) return;
        if (before_ff_) width = 7;
        before_ff_ = byte == 0xFF;
      }
      ++at_;
      bits_ = bits_ << width | unsigned(byte);
      held_ += width;
    }
  }
  std::string_view bytes_;
  std::size_t at_ = 0;
  std::uint64_t bits_ = 0;
  int held_ = 0;
  bool before_ff_ = false;
};

}  // namespace marrow::files
