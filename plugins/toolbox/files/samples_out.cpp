// SPDX-License-Identifier: Apache-2.0
// MHA and TIFF of floats, made in memory. ITK's writers do not report a full disk or a lack of memory for compression.
#include "marrow/toolbox/files/samples_out.hpp"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <new>
#include <string>

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

}  // namespace marrow::files
