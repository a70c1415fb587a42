// SPDX-License-Identifier: Apache-2.0
// Lossless JPEG (ITU T.81, process 14), as scanners and archives write it. Strict: the data must be correct to the last
// sample and bit. Common decoders fill missing samples with grey instead.
#include <array>
#include <cstring>
#include <memory>

#include "jpeg_stream.hpp"

namespace marrow::files {
namespace {

/// For each value of the next 16 bits: the symbol with which they begin, and its number of bits (0: no symbol).
struct HuffmanTable {
  std::array<std::uint8_t, 65536> bits{}, symbol{};
};

class LosslessDecoder {
 public:
  explicit LosslessDecoder(const CodedImage& image) : image_(image) {}

  std::vector<std::byte> run() {
    JpegSegments segments(image_.bytes);
    for (int marker = segments.next(); marker != 0xDA; marker = segments.next()) {
      if (marker == 0xC4)
        read_tables(segments);
      else if (marker == 0xDD)
        restart_interval_ = segments.word(0);
      else if (marker == 0xC3)
        precision_ = frame_precision(segments, image_);
      else if (marker >= 0xC0 && marker <= 0xCF)
        throw CodecNotRead("its pixels are compressed by another kind of JPEG than the header says");
    }
    if (precision_ == 0) throw CodecError("the compressed pixels have no frame header");
    read_scan_header(segments);
    return image_.bits_allocated == 8 ? samples<std::uint8_t>(segments.rest())
                                      : samples<std::uint16_t>(segments.rest());
  }

 private:
  void read_tables(const JpegSegments& segments) {
    std::size_t at = 0;
    while (at < segments.segment.size()) {
      const int place = segments.byte(at);
      if (place > 3) throw CodecError("a Huffman table of the compressed pixels is damaged");
      auto table = std::make_unique<HuffmanTable>();
      std::size_t symbol = at + 17, code = 0;
      for (int bits = 1; bits <= 16; ++bits, code <<= 1) {
        for (int count = segments.byte(at + std::size_t(bits)); count > 0; --count, ++code, ++symbol) {
          const std::size_t first = code << (16 - bits), last = (code + 1) << (16 - bits);
          if (last > 65536 || segments.byte(symbol) > 16)
            throw CodecError("a Huffman table of the compressed pixels is damaged");
          std::memset(table->bits.data() + first, bits, last - first);
          std::memset(table->symbol.data() + first, segments.byte(symbol), last - first);
        }
      }
      at = symbol;
      tables_[std::size_t(place)] = std::move(table);
    }
  }

  void read_scan_header(const JpegSegments& segments) {
    const int table = segments.byte(2) >> 4;
    predictor_ = segments.byte(3);
    shift_ = segments.byte(5) & 15;
    if (segments.byte(0) != 1 || table > 3 || !tables_[std::size_t(table)] || predictor_ < 1 || predictor_ > 7 ||
        shift_ >= precision_)
      throw CodecError("the scan header of the compressed pixels is damaged");
    table_ = tables_[std::size_t(table)].get();
    if (restart_interval_ % image_.columns != 0) throw CodecError("the compressed pixels restart within a row");
  }

  int difference(JpegBits<8>& bits) const {
    const unsigned next = bits.peek16();
    if (table_->bits[next] == 0) throw CodecError("the compressed pixels hold an unknown code");
    bits.skip(table_->bits[next]);
    const int category = table_->symbol[next];
    if (category == 0) return 0;
    if (category == 16) return 32768;
    const int value = int(bits.take(category));
    return value < 1 << (category - 1) ? value - (1 << category) + 1 : value;
  }

  template <class T>
  int predicted(const T* at, std::size_t columns) const {
    const int left = at[-1], above = *(at - columns), corner = *(at - columns - 1);
    switch (predictor_) {
      case 1:
        return left;
      case 2:
        return above;
      case 3:
        return corner;
      case 4:
        return left + above - corner;
      case 5:
        return left + ((above - corner) >> 1);
      case 6:
        return above + ((left - corner) >> 1);
      default:
        return (left + above) >> 1;
    }
  }

  template <class T>
  std::vector<std::byte> samples(std::string_view coded) const {
    const std::size_t columns = std::size_t(image_.columns), rows = std::size_t(image_.rows);
    const std::size_t rows_per_restart = restart_interval_ / image_.columns;
    const int most = (1 << (precision_ - shift_)) - 1;
    std::vector<std::byte> bytes(columns * rows * sizeof(T));
    T* at = reinterpret_cast<T*>(bytes.data());
    JpegBits<8> bits(coded);
    bool is_first_row = true;
    for (std::size_t row = 0; row < rows; ++row, is_first_row = false) {
      if (row > 0 && rows_per_restart > 0 && row % rows_per_restart == 0) {
        if (bits.marker() != 0xD0 + int((row / rows_per_restart - 1) % 8))
          throw CodecError("a restart of the compressed pixels is missing");
        is_first_row = true;
      }
      for (std::size_t column = 0; column < columns; ++column, ++at) {
        const int before = column == 0    ? (is_first_row ? 1 << (precision_ - shift_ - 1) : *(at - columns))
                           : is_first_row ? at[-1]
                                          : predicted(at, columns);
        const int value = (before + difference(bits)) & 0xFFFF;
        if (value > most) throw CodecError("the compressed pixels hold a value beyond their range");
        *at = T(value);
      }
    }
    if (bits.marker() != 0xD9) throw CodecError("the compressed pixels have no end");
    if (shift_ > 0)
      for (T* it = reinterpret_cast<T*>(bytes.data()); it != at; ++it) *it = T(*it << shift_);
    return bytes;
  }

  const CodedImage& image_;
  std::array<std::unique_ptr<HuffmanTable>, 4> tables_;
  const HuffmanTable* table_ = nullptr;
  int precision_ = 0, predictor_ = 1, shift_ = 0, restart_interval_ = 0;
};

}  // namespace

std::vector<std::byte> decode_jpeg_lossless(const CodedImage& image) { return LosslessDecoder(image).run(); }

}  // namespace marrow::files
