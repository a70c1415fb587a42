// SPDX-License-Identifier: Apache-2.0
// Images: PNG, TIFF, JPEG and BMP. Half of the PNG inputs get right checksums, so that the code behind these is tried,
// too.
#include <zlib.h>

#include <cstring>

#include "marrow/toolbox/files/volume_file.hpp"
#include "target.hpp"

namespace {

std::uint32_t big_endian(const char* at) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | std::uint8_t(at[i]);
  return value;
}

/// The chunks of a PNG with right checksums.
std::string with_checksums(std::string_view bytes) {
  std::string png(bytes);
  for (std::size_t at = 8; at + 12 <= png.size();) {
    const std::uint32_t length = big_endian(png.data() + at);
    if (length > png.size() - at - 12) break;
    const std::uint32_t checksum =
        std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(png.data() + at + 4), length + 4));
    for (int i = 0; i < 4; ++i) png[at + 8 + length + std::size_t(i)] = char(checksum >> (24 - 8 * i));
    at += 12 + std::size_t(length);
  }
  return png;
}

std::filesystem::path file_of(marrow::fuzz::Input& input) {
  switch (input.choice("cptjb")) {
    case 'c':
      return marrow::fuzz::put("a.png", with_checksums(input.rest));
    case 'p':
      return marrow::fuzz::put("a.png", input.rest);
    case 'j':
      return marrow::fuzz::put("a.jpg", input.rest);
    case 'b':
      return marrow::fuzz::put("a.bmp", input.rest);
    default:
      return marrow::fuzz::put("a.tif", input.rest);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  marrow::fuzz::Input input(data, size);
  const int frame = input.choice("12") == '1' ? 0 : 2;
  const std::filesystem::path path = file_of(input);
  marrow::fuzz::expect_value_or_error([&] { marrow::files::read_image_file(path, frame); });
  return 0;
}
