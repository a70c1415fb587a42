// SPDX-License-Identifier: Apache-2.0
// JPEG-LS (ITU T.87) in DICOM files, by CharLS.
#include <charls/charls.h>

#include "codecs.hpp"

namespace marrow::files {

std::vector<std::byte> decode_jpeg_ls(const CodedImage& image, bool is_lossless) {
  try {
    const charls::jpegls_decoder decoder(image.bytes, true);
    const charls::frame_info& frame = decoder.frame_info();
    check_coded(image, frame.width, frame.height, frame.component_count, frame.bits_per_sample);
    if (is_lossless && decoder.near_lossless() != 0)
      throw CodecNotRead("its pixels are compressed by another kind of JPEG than the header says");
    std::vector<std::byte> samples(image.count() * (frame.bits_per_sample > 8 ? 2 : 1));
    decoder.decode(samples);
    return as_allocated(image, std::move(samples), frame.bits_per_sample);
  } catch (const charls::jpegls_error& error) {
    if (error.code() == charls::jpegls_errc::encoding_not_supported)
      throw CodecNotRead("its pixels are compressed by another kind of JPEG than the header says");
    throw CodecError("the compressed pixels cannot be decoded (" + std::string(error.what()) + ")");
  }
}

}  // namespace marrow::files
