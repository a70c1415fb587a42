// SPDX-License-Identifier: Apache-2.0
// MHA, TIFF of floats and PNG, made in memory. ITK's writers do not report a full disk or a lack of memory for
// compression, and the one of PNG ends the whole program if the disk is full.
#include "marrow/toolbox/files/samples_out.hpp"

#include <zlib.h>

#include <png.h>
#include <algorithm>
#include <bit>
#include <csetjmp>
#include <limits>
#include <new>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::files {
namespace {

static_assert(std::endian::native == std::endian::little, "both files say that their numbers are little-endian");

constexpr int kLevel = 2;  // compresses a CT of 420 MB in seconds; higher levels take minutes to save a few percent

/// Works in parts, because zlib counts bytes in 32 bits.
std::string deflated(const char* bytes, std::size_t size) {
  z_stream stream{};
  if (deflateInit(&stream, kLevel) != Z_OK) throw std::bad_alloc();
  const struct End {
    z_stream& stream;
    ~End() { deflateEnd(&stream); }
  } end{stream};
  std::string packed;
  std::string part(std::size_t(1) << 20, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes));
  for (int state = Z_OK; state != Z_STREAM_END;) {
    if (stream.avail_in == 0) {
      stream.avail_in = uInt(std::min<std::size_t>(size, std::size_t(1) << 30));
      size -= stream.avail_in;
    }
    stream.next_out = reinterpret_cast<Bytef*>(part.data());
    stream.avail_out = uInt(part.size());
    state = deflate(&stream, size == 0 ? Z_FINISH : Z_NO_FLUSH);
    packed.append(part.data(), part.size() - stream.avail_out);
  }
  return packed;
}

template <class Values>
std::string listed(const Values& values) {
  std::string text;
  for (const auto& value : values) text += " " + number(double(value));
  return text;
}

/// A field of a TIFF directory with one value.
void append_field(std::string& bytes, std::uint16_t tag, std::uint32_t value) {
  constexpr std::uint16_t kLong = 4;
  constexpr std::uint32_t kOne = 1;
  bytes.append(reinterpret_cast<const char*>(&tag), sizeof tag);
  bytes.append(reinterpret_cast<const char*>(&kLong), sizeof kLong);
  bytes.append(reinterpret_cast<const char*>(&kOne), sizeof kOne);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

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

void write_mha(const std::filesystem::path& path, const GridOut& grid, const float* values) {
  std::size_t count = 1;
  for (const int size : grid.size) count *= std::size_t(size);
  const std::string packed = deflated(reinterpret_cast<const char*>(values), count * sizeof(float));
  std::string matrix;
  for (const auto& axis : grid.axes) matrix += listed(axis);
  const std::string header = formatted(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
      "True\nCompressedDataSize = {}\nTransformMatrix ={}\nOffset ={}\nCenterOfRotation = 0 0 0\nElementSpacing "
      "={}\nDimSize ={}\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n",
      packed.size(), matrix, listed(grid.origin_mm), listed(grid.spacing_mm), listed(grid.size));
  write_plainly(path, {header, packed});
}

void write_float_tiff(const std::filesystem::path& path, int width, int height, const float* pixels) {
  const std::size_t size = std::size_t(width) * std::size_t(height) * sizeof(float);
  constexpr std::uint32_t kDirectory = 8, kFields = 10,
                          kPixels = 136;  // after the header, the directory and two unused bytes
  if (size > std::numeric_limits<std::uint32_t>::max() - kPixels)
    throw Error(
        formatted("{}: an image of {} x {} pixels is larger than a TIFF file can be", path.string(), width, height));
  std::string head("II*\0", 4);
  head.append(reinterpret_cast<const char*>(&kDirectory), sizeof kDirectory);
  head += {char(kFields), 0};
  append_field(head, 256, std::uint32_t(width));
  append_field(head, 257, std::uint32_t(height));
  append_field(head, 258, 32);                     // bits per sample
  append_field(head, 259, 1);                      // not compressed
  append_field(head, 262, 1);                      // 0 is black
  append_field(head, 273, kPixels);                // offset of the only strip
  append_field(head, 277, 1);                      // samples per pixel
  append_field(head, 278, std::uint32_t(height));  // rows of the strip
  append_field(head, 279, std::uint32_t(size));    // bytes of the strip
  append_field(head, 339, 3);                      // floating point
  head.resize(kPixels, '\0');                      // no further directory
  write_plainly(path, {head, {reinterpret_cast<const char*>(pixels), size}});
}

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
