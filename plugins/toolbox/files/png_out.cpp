// SPDX-License-Identifier: Apache-2.0
// PNG by libpng directly, in memory, because ITK's writer ends the whole program if the disk is full.
#include <png.h>

#include <bit>
#include <csetjmp>
#include <new>
#include <string>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/samples_out.hpp"

namespace marrow::files {
namespace {

/// Given to libpng. libpng is C, so no exception may pass through it.
struct Target {
  std::string bytes, fault;
};

void put(png_structp png, png_bytep bytes, std::size_t count) {
  bool is_kept = true;
  try {
    static_cast<Target*>(png_get_io_ptr(png))->bytes.append(reinterpret_cast<const char*>(bytes), count);
  } catch (const std::exception&) {
    is_kept = false;
  }
  if (!is_kept) png_error(png, "out of memory");
}

void flush(png_structp) {}

void on_writing_error(png_structp png, png_const_charp reason) {
  try {
    static_cast<Target*>(png_get_error_ptr(png))->fault = reason;
  } catch (const std::exception&) {  // then there is no reason in the message
  }
  png_longjmp(png, 1);
}

void on_writing_warning(png_structp, png_const_charp) {}

struct Writer {
  explicit Writer(Target& target)
      : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, &target, on_writing_error, on_writing_warning)),
        info(png ? png_create_info_struct(png) : nullptr) {
    if (info) png_set_write_fn(png, &target, put, flush);
  }
  ~Writer() { png_destroy_write_struct(&png, &info); }
  png_structp png;
  png_infop info;
};

/// No object with a destructor may live between setjmp and the calls that can jump back to it.
bool write_rows(Writer& writer, int width, int height, int channels, int bits, png_bytepp rows) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_set_IHDR(writer.png, writer.info, png_uint_32(width), png_uint_32(height), bits,
               channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(writer.png, 4);
  png_write_info(writer.png, writer.info);
  if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(writer.png);
  png_write_image(writer.png, rows);
  png_write_end(writer.png, nullptr);
  return true;
}

}  // namespace

std::string png_of(int width, int height, int channels, Sample sample, const void* pixels) {
  const int bits = sample == Sample::u16 ? 16 : 8;
  const std::size_t row_bytes = std::size_t(width) * std::size_t(channels) * std::size_t(bits / 8);
  std::vector<png_bytep> rows;
  // libpng's interface takes writable rows, but it does not write to them.
  auto* first = static_cast<png_bytep>(const_cast<void*>(pixels));
  for (int v = 0; v < height; ++v) rows.push_back(first + std::size_t(v) * row_bytes);
  Target target;
  Writer writer(target);
  if (!writer.info) throw std::bad_alloc();
  if (!write_rows(writer, width, height, channels, bits, rows.data()))
    throw Error(formatted("libpng cannot write an image of {} x {} pixels: {}", width, height, target.fault));
  return std::move(target.bytes);
}

void write_png(const std::filesystem::path& path, int width, int height, int channels, Sample sample,
               const void* pixels) {
  write_plainly(path, {png_of(width, height, channels, sample, pixels)});
}

}  // namespace marrow::files
