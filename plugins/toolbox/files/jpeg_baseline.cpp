// SPDX-License-Identifier: Apache-2.0
// Baseline JPEG in DICOM files, by libjpeg.
#include "jpeg_stream.hpp"
#include "libjpeg.hpp"

namespace marrow::files {
namespace {

/// No object with a destructor may live between setjmp and the calls that can jump back to it.
bool decode(jpeg_decompress_struct& state, JpegFailure& failure, const CodedImage& image, std::byte* to) {
  if (setjmp(failure.back)) return false;
  jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(image.bytes.data()), image.bytes.size());
  jpeg_read_header(&state, TRUE);
  if (int(state.image_width) != image.columns || int(state.image_height) != image.rows || state.num_components != 1) {
    std::snprintf(failure.text, sizeof failure.text, "the compressed pixels tell of two sizes");
    return false;
  }
  state.out_color_space = JCS_GRAYSCALE;
  read_jpeg_rows(state, to, std::size_t(image.columns));
  return true;
}

}  // namespace

std::vector<std::byte> decode_jpeg_baseline(const CodedImage& image) {
  JpegSegments segments(image.bytes);
  int marker = segments.next();
  while (marker < 0xC0 || marker > 0xCF || marker == 0xC4 || marker == 0xCC) {
    if (marker == 0xDA) throw CodecError("the compressed pixels have no frame header");
    marker = segments.next();
  }
  if (marker != 0xC0) throw CodecNotRead("its pixels are compressed by another kind of JPEG than the header says");
  if (frame_precision(segments, image) != 8 || image.bits_allocated != 8) throw CodecError("baseline JPEG has 8 bits");
  std::vector<std::byte> bytes(std::size_t(image.columns) * std::size_t(image.rows));
  JpegReader reader;
  if (!decode(reader.state, reader.failure, image, bytes.data())) throw CodecError(reader.failure.text);
  return bytes;
}

}  // namespace marrow::files
