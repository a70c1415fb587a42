// SPDX-License-Identifier: Apache-2.0
// JPEG files, as cameras and archives export them: 8 bits, grey or in colours.
#include "exif.hpp"
#include "jpeg_segments.hpp"
#include "libjpeg.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLargestJpeg = 1 << 30;

/// Checks what libjpeg would ignore, or refuse as if the file were damaged.
void check_segments(const std::string& what, const std::string& bytes) {
  constexpr int kExif = 0xE1, kHuffman = 0xC4, kArithmetic = 0xC8, kConditioning = 0xCC, kProgressive = 0xC2;
  JpegSegments segments(bytes);
  while (true) {
    const int marker = segments.next();
    if (marker == kExif && segments.segment.substr(0, 6) == std::string_view("Exif\0\0", 6))
      check_not_turned(what, segments.segment.substr(6));
    if (marker < 0xC0 || marker > 0xCF || marker == kHuffman || marker == kArithmetic || marker == kConditioning)
      continue;
    if (marker > kProgressive)
      throw Error(what +
                  ": is a JPEG of a kind that is not read (lossless, or with arithmetic coding); save it as PNG");
    if (const int bits = segments.byte(0); bits != 8)
      throw Error(
          formatted("{}: is a JPEG of {} bits, of which only those of 8 are read; save it as PNG, which keeps all bits",
                    what, bits));
    return;
  }
}

bool read_jpeg_header(jpeg_decompress_struct& state, JpegFailure& failure, const std::string& bytes) {
  if (setjmp(failure.back)) return false;
  jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&state, TRUE);
  if (state.jpeg_color_space != JCS_GRAYSCALE && state.num_components == 3) state.out_color_space = JCS_RGB;
  return true;
}

bool read_rows_or_fail(jpeg_decompress_struct& state, JpegFailure& failure, std::byte* to, std::size_t row_bytes) {
  if (setjmp(failure.back)) return false;
  read_jpeg_rows(state, to, row_bytes);
  return true;
}

}  // namespace

Samples read_jpeg(const std::filesystem::path& path) {
  const std::string what = path.string(), bytes = read_bytes(path, kLargestJpeg);
  const auto fail = [&](const std::string& fault) {
    throw Error(what + ": cannot be read as JPEG, it may be cut off or damaged (" + fault +
                "); copy or export it again");
  };
  try {
    check_segments(what, bytes);
  } catch (const CodecError& error) {
    fail(error.what());
  }
  JpegReader reader;
  if (!read_jpeg_header(reader.state, reader.failure, bytes)) fail(reader.failure.text);
  Samples samples;
  samples.dimensions = 2;
  samples.size = {int(reader.state.image_width), int(reader.state.image_height), 1};
  samples.components = reader.state.num_components;
  check_size(what, {samples.size[0], samples.size[1], samples.components}, bytes.size());
  if (samples.components != 1 && samples.components != 3)
    throw Error(formatted("{}: has {} colours, as for printing; an X-ray image is grey: save it as grey levels", what,
                          samples.components));
  const std::size_t row_bytes = std::size_t(samples.size[0]) * std::size_t(samples.components);
  samples.bytes.resize(row_bytes * std::size_t(samples.size[1]));
  if (!read_rows_or_fail(reader.state, reader.failure, samples.bytes.data(), row_bytes)) fail(reader.failure.text);
  return samples;
}

}  // namespace marrow::files
