// SPDX-License-Identifier: Apache-2.0
// The pixels of one strip of a TIFF: plain, PackBits, LZW or Deflate, with or without differences along rows (TIFF 6.0,
// sections 9, 13, 14).
#include <algorithm>
#include <cstring>

#include "byte_stream.hpp"
#include "marrow/base/error.hpp"
#include "packbits.hpp"
#include "tiff_pages.hpp"

namespace marrow::files {
namespace {

/// Unpacks LZW: codes of 9 to 12 bits, the high bit first. Each code stands for the bytes of an earlier code and one
/// more byte. Returns the number of bytes; 0 if the data are damaged.
std::size_t unpack_lzw(const std::string& packed, std::byte* to, std::size_t bytes) {
  constexpr unsigned kClear = 256, kEnd = 257, kFirst = 258, kMost = 4096;
  struct Code {
    std::uint16_t before;
    std::uint16_t length;
    std::uint8_t last, first;
  };
  std::vector<Code> codes(kMost);
  for (unsigned i = 0; i < 256; ++i) codes[i] = {0, 1, std::uint8_t(i), std::uint8_t(i)};
  unsigned next = kFirst, width = 9, before = kClear, held_bits = 0;
  std::uint32_t held = 0;
  std::size_t done = 0, at = 0;
  while (true) {
    while (held_bits < width) {
      if (at == packed.size()) return done;  // an end code may be missing
      held = held << 8 | std::uint8_t(packed[at++]);
      held_bits += 8;
    }
    const unsigned code = held >> (held_bits - width) & ((1u << width) - 1);
    held_bits -= width;
    if (code == kEnd) return done;
    if (code == kClear) {
      next = kFirst, width = 9, before = kClear;
      continue;
    }
    if (code > next || (code == next && before == kClear) || code == kClear || (code >= kFirst && before == kClear))
      return 0;
    if (before != kClear && next < kMost) {
      const std::uint8_t last = code == next ? codes[before].first : codes[code].first;
      codes[next++] = {std::uint16_t(before), std::uint16_t(codes[before].length + 1), last, codes[before].first};
    }
    const std::size_t length = codes[code].length;
    if (length > bytes - done) return 0;
    for (std::size_t i = length, c = code; i > 0; --i, c = codes[c].before) to[done + i - 1] = std::byte(codes[c].last);
    done += length;
    before = code;
    if (next + 1 >= (1u << width) && width < 12) ++width;  // one code early, as TIFF defines it
  }
}

/// `each`: samples of a pixel. A sample is stored as its difference from that of the pixel before.
template <class T>
void add_up(std::byte* row, std::size_t samples, std::size_t each) {
  for (std::size_t i = each; i < samples; ++i) {
    T value, before;
    std::memcpy(&value, row + i * sizeof(T), sizeof(T));
    std::memcpy(&before, row + (i - each) * sizeof(T), sizeof(T));
    value = T(value + before);
    std::memcpy(row + i * sizeof(T), &value, sizeof(T));
  }
}

void undo_differences(const TiffPage& page, std::byte* rows, std::size_t bytes) {
  const std::size_t each = std::size_t(page.samples_together()), samples = std::size_t(page.width) * each;
  const std::size_t row_bytes = samples * std::size_t(page.bits / 8);
  for (std::size_t at = 0; at < bytes; at += row_bytes) {
    if (page.bits == 8) add_up<std::uint8_t>(rows + at, samples, each);
    if (page.bits == 16) add_up<std::uint16_t>(rows + at, samples, each);
    if (page.bits == 32) add_up<std::uint32_t>(rows + at, samples, each);
  }
}

}  // namespace

void read_tiff_strip(const InputFile& file, const TiffPages& tiff, const TiffPage& page, const TiffStrip& strip,
                     std::byte* to, std::size_t bytes) {
  std::size_t got = 0;
  if (page.compression == 1) {
    got = std::size_t(std::min<std::uint64_t>(strip.bytes, bytes));
    file.read(strip.begin, to, got);
  } else if (page.compression == 8 || page.compression == 32946) {
    const auto stream = unpacked_bytes(file, strip.begin, strip.begin + strip.bytes);
    got = stream->take(to, bytes);
    std::array<char, 4096> filling;
    stream->take(filling.data(), filling.size());  // reads on, so that the checksum is verified
  } else {
    const std::string packed = file.text(strip.begin, std::size_t(strip.bytes));
    got = page.compression == 5 ? unpack_lzw(packed, to, bytes) : unpack_packbits(packed, to, bytes);
  }
  if (got != bytes)
    throw Error(file.path().string() +
                ": is cut off or damaged: a strip of its pixels does not hold what its header claims; copy or export "
                "it again");
  if (tiff.big_endian)
    for (std::size_t width = std::size_t(page.bits / 8), at = 0; width > 1 && at < bytes; at += width)
      std::reverse(to + at, to + at + width);
  if (page.predictor == 2) undo_differences(page, to, bytes);
}

}  // namespace marrow::files
