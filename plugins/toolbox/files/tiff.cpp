// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"
#include "tiff_pages.hpp"

namespace marrow::files {
namespace {

void check_kind(const std::string& what, const TiffPage& page) {
  static constexpr std::uint16_t kCompressions[] = {1, 5, 8, 32773, 32946};
  if (std::find(std::begin(kCompressions), std::end(kCompressions), page.compression) == std::end(kCompressions))
    throw Error(
        formatted("{}: its pixels are compressed by method {}, which is not read; save it with LZW, Deflate or without "
                  "compression (tiffcp -c lzw does it)",
                  what, page.compression));
  if (page.fill_order != 1 || (page.orientation != 1 && page.orientation != 4))
    throw Error(formatted(
        "{}: its pixels are stored in an unusual order (FillOrder {}, Orientation {}); save it again as a plain TIFF",
        what, page.fill_order, page.orientation));
  if (page.subfile & 5) throw Error(what + ": holds a thumbnail or a mask beside its image; save the image alone");
}

Samples::Type type_of(const std::string& what, const TiffPage& page) {
  using Type = Samples::Type;
  if (page.bits == 8 && page.format == 1) return Type::u8;
  if (page.bits == 8 && page.format == 2) return Type::i8;
  if (page.bits == 16 && page.format == 1) return Type::u16;
  if (page.bits == 16 && page.format == 2) return Type::i16;
  if (page.bits == 32 && page.format == 1) return Type::u32;
  if (page.bits == 32 && page.format == 2) return Type::i32;
  if (page.bits == 32 && page.format == 3) return Type::f32;
  if (page.bits == 64 && page.format == 3) return Type::f64;
  throw Error(
      formatted("{}: its pixels have {} bits in a format that is not read; save it with 8 or 16 bits, or as float",
                what, page.bits));
}

/// An image of some scanners has its bottom row first.
void turn_rows(const TiffPage& page, std::size_t width, std::byte* pixels) {
  const std::size_t row_bytes = page.width * page.samples_together() * width;
  const std::size_t planes = page.samples / page.samples_together();
  for (std::size_t plane = 0; plane < planes; ++plane, pixels += page.height * row_bytes)
    for (std::size_t v = 0; v < page.height / 2; ++v)
      std::swap_ranges(pixels + v * row_bytes, pixels + (v + 1) * row_bytes,
                       pixels + (page.height - 1 - v) * row_bytes);
}

/// Puts the samples of a pixel side by side.
void join_planes(const TiffPage& page, std::size_t width, std::byte* pixels) {
  const std::size_t count = std::size_t(page.width) * page.height, each = std::size_t(page.samples);
  const std::vector<std::byte> planes(pixels, pixels + count * each * width);
  for (std::size_t k = 0; k < each; ++k)
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(pixels + (i * each + k) * width, planes.data() + (k * count + i) * width, width);
}

/// The colours of indices of 8 bits. The palette has 16 bits a value, of which screens show the upper 8.
void look_up_colours(const std::string& what, const TiffPage& page, Samples& samples) {
  if (page.palette[0].empty())
    throw Error(what + ": is damaged: its pixels are colours of a palette, but it has none; copy or export it again");
  std::vector<std::byte> colours(3 * samples.bytes.size());
  for (std::size_t i = 0; i < colours.size(); ++i)
    colours[i] = std::byte(page.palette[i % 3][std::size_t(samples.bytes[i / 3])] >> 8);
  samples.bytes = std::move(colours);
  samples.components = 3;
}

/// Whether its colours, or grey levels with an opacity, are of a kind that is read.
bool has_plain_colours(const TiffPage& page) {
  constexpr std::uint16_t kRgb = 2, kPalette = 3;
  if (page.format != 1 || (page.planes != 1 && page.planes != 2)) return false;
  if (page.photometric == kPalette) return page.samples == 1 && page.bits == 8;
  if (page.bits != 8 && page.bits != 16) return false;
  return page.photometric == kRgb ? page.samples == 3 || page.samples == 4 : page.photometric == 1 && page.samples == 2;
}

template <class T>
void invert_as(std::vector<std::byte>& bytes) {
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(T)) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    value = T(~value);
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }
}

/// Inverts an image whose zero is white, so that higher values are brighter, as in other images.
void invert(const std::string& what, Samples& samples) {
  if (samples.type == Samples::Type::u8) return invert_as<std::uint8_t>(samples.bytes);
  if (samples.type == Samples::Type::u16) return invert_as<std::uint16_t>(samples.bytes);
  throw Error(what +
              ": its zero is white (PhotometricInterpretation WhiteIsZero); that is read for whole numbers of 8 "
              "and 16 bits without sign only: save it with zero as black");
}

/// ImageJ defines its calibration for unsigned integers only, and not for inverted ones.
void check_calibration(const std::string& what, const Samples& samples, const TiffPage& page) {
  if (samples.slope == 1 && samples.intercept == 0) return;
  const bool is_plain = samples.type == Samples::Type::u8 || samples.type == Samples::Type::u16;
  if (!is_plain || page.photometric == 0)
    throw Error(what + ": its values are calibrated by ImageJ (c0, c1), and " +
                (is_plain ? "its zero is white" : "its pixels are not whole numbers of 8 or 16 bits without sign") +
                "; save it uncalibrated (in ImageJ: Analyze, Calibrate), or as float");
}

}  // namespace

Samples read_tiff(const std::filesystem::path& path) {
  const InputFile file(path);
  const TiffPages tiff = read_tiff_pages(file);
  const TiffPage& first = tiff.pages[0];
  const std::string what = path.string();
  Samples samples;
  samples.dimensions = tiff.pages.size() > 1 ? 3 : 2;
  samples.other_pages = tiff.other_pages;
  samples.slope = tiff.slope;
  samples.intercept = tiff.intercept;
  samples.size = {int(first.width), int(first.height), int(tiff.pages.size())};
  samples.components = first.samples;
  const bool is_grey = first.samples == 1 && first.photometric <= 1;
  if (!is_grey && !has_plain_colours(first)) {
    samples.components = std::max(samples.components, 3);
    return samples;
  }
  for (const TiffPage& page : tiff.pages) check_kind(what, page);
  samples.type = type_of(what, first);
  check_calibration(what, samples, first);
  check_size(what, {samples.size[0], samples.size[1], samples.size[2]}, file.size());
  const std::size_t width = bytes_each(samples.type);
  const std::size_t page_bytes = std::size_t(first.width) * first.height * first.samples * width;
  samples.bytes.resize(page_bytes * tiff.pages.size());
  TiffReader reader(file);
  for (std::byte* to = samples.bytes.data(); const TiffPage& page : tiff.pages) {
    reader.read_strips(page, to);
    if (page.orientation == 4) turn_rows(page, width, to);
    if (page.planes == 2 && page.samples > 1) join_planes(page, width, to);
    to += page_bytes;
    reader.next();
  }
  if (first.photometric == 3) look_up_colours(what, first, samples);
  if (first.photometric == 0) invert(what, samples);
  return samples;
}

}  // namespace marrow::files
