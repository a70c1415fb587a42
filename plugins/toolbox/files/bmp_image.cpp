// SPDX-License-Identifier: Apache-2.0
// BMP without compression, as frame grabbers write it. It holds colours, which are equal in a grey image.
#include <cstring>
#include <string_view>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLargestBmp = 1 << 30;

struct BmpHeader {
  std::size_t pixels = 0, palette = 0, palette_step = 4;  ///< offsets in the file, and bytes of a colour
  long long width = 0, height = 0;                        ///< the height is negative if the upper row is the first
  std::uint32_t bits = 0, compression = 0;
  bool has_opacity = false;
};

/// The bytes of a file by their offsets. Throws Error beyond the end.
class BmpBytes {
 public:
  BmpBytes(std::string what, std::string_view bytes) : what_(std::move(what)), bytes_(bytes) {}
  std::uint32_t number(std::size_t at, std::size_t width) const {
    return std::uint32_t(number_in_bytes({reinterpret_cast<const char*>(part(at, width)), width}, false));
  }
  const std::uint8_t* part(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || count > bytes_.size() - at)
      throw Error(formatted("{}: is cut off or damaged: {} bytes expected, got {}; copy or export it again", what_,
                            at + count, bytes_.size()));
    return reinterpret_cast<const std::uint8_t*>(bytes_.data()) + at;
  }
  const std::string& what() const { return what_; }

 private:
  std::string what_;
  std::string_view bytes_;
};

[[noreturn]] void refuse_kind(const BmpBytes& bytes, const BmpHeader& header) {
  throw Error(formatted("{}: is a BMP of {} bits stored by method {}, which is not read; save it as PNG", bytes.what(),
                        header.bits, header.compression));
}

/// Checks where the bits of red, green, blue and opacity are, and whether there is an opacity.
void read_masks(const BmpBytes& bytes, std::size_t header_bytes, BmpHeader& header) {
  constexpr std::uint32_t kUsual[] = {0xFF0000, 0xFF00, 0xFF};
  for (std::size_t k = 0; k < 3; ++k)
    if (bytes.number(54 + 4 * k, 4) != kUsual[k]) refuse_kind(bytes, header);
  header.has_opacity = header_bytes >= 56 && bytes.number(66, 4) == 0xFF000000;
}

BmpHeader read_bmp_header(const BmpBytes& bytes) {
  if (std::memcmp(bytes.part(0, 2), "BM", 2) != 0)
    throw Error(bytes.what() + ": is not a BMP file, or is damaged at its start");
  BmpHeader header;
  header.pixels = bytes.number(10, 4);
  const std::size_t header_bytes = bytes.number(14, 4);
  const bool is_old = header_bytes == 12;
  const auto length = [&](std::size_t at) { return std::int32_t(bytes.number(at, is_old ? 2 : 4)); };
  header.width = length(18);
  header.height = length(is_old ? 20 : 22);
  header.bits = bytes.number(is_old ? 24 : 28, 2);
  header.compression = is_old ? 0 : bytes.number(30, 4);
  header.palette = 14 + header_bytes;
  header.palette_step = is_old ? 3 : 4;
  constexpr std::uint32_t kByMasks = 3;
  if (header.compression == kByMasks && header.bits == 32)
    read_masks(bytes, header_bytes, header);
  else if (header.compression != 0 ||
           (header.bits != 1 && header.bits != 4 && header.bits != 8 && header.bits != 24 && header.bits != 32))
    refuse_kind(bytes, header);
  return header;
}

/// Writes red, green and blue of one row, and the opacity if there is one.
void read_bmp_row(const BmpBytes& bytes, const BmpHeader& header, const std::uint8_t* row, std::uint8_t* to) {
  const std::uint32_t bits = header.bits;
  for (std::size_t u = 0; u < std::size_t(header.width); ++u) {
    const std::uint8_t* pixel = row + u * bits / 8;
    const std::uint8_t opacity = bits == 32 ? pixel[3] : 0;
    if (bits <= 8) {
      const std::uint32_t shift = 8 - bits - std::uint32_t(u * bits % 8), index = *pixel >> shift & ((1u << bits) - 1);
      const std::size_t place = header.palette + index * header.palette_step;
      if (place + header.palette_step > header.pixels)
        throw Error(formatted(
            "{}: is damaged: a pixel has the colour {}, which its palette does not have; copy or export it again",
            bytes.what(), index));
      pixel = bytes.part(place, header.palette_step);
    }
    for (std::size_t k = 0; k < 3; ++k) *to++ = pixel[2 - k];  // blue is the first
    if (header.has_opacity) *to++ = opacity;
  }
}

}  // namespace

Samples read_bmp(const std::filesystem::path& path) {
  const std::string content = read_bytes(path, kLargestBmp);
  const BmpBytes bytes(path.string(), content);
  const BmpHeader header = read_bmp_header(bytes);
  const long long height = std::abs(header.height);
  Samples samples;
  samples.components = header.has_opacity ? 4 : 3;
  check_size(bytes.what(), {header.width, height, 1}, content.size());
  samples.dimensions = 2;
  samples.size = {int(header.width), int(height), 1};
  const std::size_t rows = std::size_t(height), row_bytes = (std::size_t(header.width) * header.bits + 31) / 32 * 4;
  const std::uint8_t* const stored = bytes.part(header.pixels, rows * row_bytes);
  const std::size_t row_samples = std::size_t(header.width) * std::size_t(samples.components);
  samples.bytes.resize(rows * row_samples);
  for (std::size_t v = 0; v < rows; ++v) {
    const std::size_t from = header.height > 0 ? rows - 1 - v : v;
    read_bmp_row(bytes, header, stored + from * row_bytes,
                 reinterpret_cast<std::uint8_t*>(samples.bytes.data()) + v * row_samples);
  }
  return samples;
}

}  // namespace marrow::files
