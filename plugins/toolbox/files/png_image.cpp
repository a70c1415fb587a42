// SPDX-License-Identifier: Apache-2.0
// PNG by libpng directly, because ITK's reader ends the whole program if a file is cut off.
#include <png.h>

#include <csetjmp>
#include <cstring>
#include <new>
#include <string_view>

#include "exif.hpp"
#include "marrow/base/error.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLargestPng = 1 << 30;

struct Source {
  std::string bytes;
  std::size_t at = 0;
  std::string fault;
};

void take(png_structp png, png_bytep out, std::size_t count) {
  Source& source = *static_cast<Source*>(png_get_io_ptr(png));
  if (source.bytes.size() - source.at < count) png_error(png, "it ends too early");
  std::memcpy(out, source.bytes.data() + source.at, count);
  source.at += count;
}

void on_error(png_structp png, png_const_charp message) {
  static_cast<Source*>(png_get_error_ptr(png))->fault = message;
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

struct Reader {
  explicit Reader(Source& source) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &source, on_error, on_warning);
    info = png_create_info_struct(png);
    if (!info) {
      png_destroy_read_struct(&png, nullptr, nullptr);
      throw std::bad_alloc();
    }
    png_set_read_fn(png, &source, take);
    // Only pixels are read. libpng would reserve the memory that a comment claims, and would only warn if that is much.
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
    // Text and colour profiles are not needed, but libpng decompresses them. Their number and size are limited.
    png_set_chunk_malloc_max(png, 4 << 20);
    png_set_chunk_cache_max(png, 16);
    png_set_user_limits(png, 100000, 100000);
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  png_structp png = nullptr;
  png_infop info = nullptr;
};

// In the next two functions no object with a destructor may live between setjmp and the calls that can jump back to it.

bool read_header(Reader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_info(reader.png, reader.info);
  png_set_expand(reader.png);  // palettes to colours, 1-4 bits to 8
  png_set_swap(reader.png);    // 16 bits are stored big-endian
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_rows(Reader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

void check_orientation(const std::string& what, std::string_view bytes) {
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const std::size_t length = std::size_t(number_in_bytes(bytes.substr(at, 4), true));
    if (length > bytes.size() - at - 12) return;  // cut off; libpng reports this if it needs the chunk
    if (bytes.substr(at + 4, 4) == "eXIf") check_not_turned(what, bytes.substr(at + 8, length));
    at += 12 + length;
  }
}

}  // namespace

Samples read_png(const std::filesystem::path& path) {
  const std::string what = path.string();
  Source source;
  source.bytes = read_bytes(path, kLargestPng);
  if (source.bytes.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(source.bytes.data()), 0, 8))
    throw Error(what + ": is not a PNG file, or is damaged at its start");
  check_orientation(what, source.bytes);
  const auto fail = [&] {
    throw Error(what + ": cannot be read as PNG, it may be cut off or damaged (" + source.fault +
                "); copy or export it again");
  };
  Reader reader(source);
  if (!read_header(reader)) fail();
  Samples samples;
  samples.dimensions = 2;
  samples.size = {int(png_get_image_width(reader.png, reader.info)), int(png_get_image_height(reader.png, reader.info)),
                  1};
  samples.components = png_get_channels(reader.png, reader.info);
  samples.type = png_get_bit_depth(reader.png, reader.info) == 16 ? Samples::Type::u16 : Samples::Type::u8;
  const std::size_t row_bytes = png_get_rowbytes(reader.png, reader.info);
  check_size(what, {samples.size[0], samples.size[1], samples.components}, source.bytes.size());
  samples.bytes.resize(row_bytes * std::size_t(samples.size[1]));
  std::vector<png_bytep> rows;
  for (int v = 0; v < samples.size[1]; ++v)
    rows.push_back(reinterpret_cast<png_bytep>(samples.bytes.data() + row_bytes * std::size_t(v)));
  if (!read_rows(reader, rows.data())) fail();
  return samples;
}

}  // namespace marrow::files
