// SPDX-License-Identifier: Apache-2.0
// JPEG in DICOM files (ITU T.81: baseline, extended, lossless), by the decoders of DCMTK for 8, 12 and 16 bits.
#include <dcmtk/config/osconfig.h>
// DCMTK wants its configuration first.
#include <dcmtk/dcmjpeg/djcparam.h>
#include <dcmtk/dcmjpeg/djdijg12.h>
#include <dcmtk/dcmjpeg/djdijg16.h>
#include <dcmtk/dcmjpeg/djdijg8.h>

#include "jpeg_segments.hpp"

namespace marrow::files {
namespace {

constexpr int kBaseline = 0xC0, kExtended = 0xC1, kLossless = 0xC3, kScan = 0xDA;

/// DCMTK logs a warning where data end too early or hold an unknown code, and fills the rest with grey. Here a warning
/// is an error.
template <class Decoder>
class Strict : public Decoder {
 public:
  explicit Strict(const DJCodecParameter& parameter) : Decoder(parameter, OFFalse) {}
  void emitMessage(int level) const override { has_warned = has_warned || level < 0; }
  mutable bool has_warned = false;
};

template <class Decoder>
std::vector<std::byte> decoded(const CodedImage& image, int bits) {
  const DJCodecParameter parameter(ECC_lossyYCbCr, EDC_never, EUC_default, EPC_default);
  Strict<Decoder> decoder(parameter);
  std::vector<std::byte> samples(image.count() * decoder.bytesPerSample());
  OFCondition state = decoder.init();
  if (state.good())
    state = decoder.decode(reinterpret_cast<Uint8*>(const_cast<char*>(image.bytes.data())), Uint32(image.bytes.size()),
                           reinterpret_cast<Uint8*>(samples.data()), Uint32(samples.size()), OFFalse);
  if (state == EJ_Suspension) throw CodecError("the compressed pixels end too early");
  if (state.bad()) throw CodecError("the compressed pixels cannot be decoded (" + std::string(state.text()) + ")");
  if (decoder.has_warned) throw CodecError("the compressed pixels hold an unknown code");
  return as_allocated(image, std::move(samples), bits);
}

/// The precision, after the frame header was checked.
int checked_precision(const CodedImage& image, JpegProcess process) {
  JpegSegments segments(image.bytes);
  int marker = segments.next();
  while (marker < kBaseline || marker > 0xCF || marker == 0xC4 || marker == 0xC8 || marker == 0xCC) {
    if (marker == kScan) throw CodecError("the compressed pixels have no frame header");
    marker = segments.next();
  }
  const bool is_told = process == JpegProcess::lossless ? marker == kLossless
                       : marker == kBaseline            ? true
                                                        : process == JpegProcess::extended && marker == kExtended;
  if (!is_told) throw CodecNotRead("its pixels are compressed by another kind of JPEG than the header says");
  const int precision = segments.byte(0);
  check_coded(image, segments.word(3), segments.word(1), segments.byte(5), precision);
  return precision;
}

/// Some writers say in the scan header that no coefficients follow the first one (Se is 0), which is meant for the
/// progressive process. DCMTK warns of it and reads all, which is right.
void say_all_coefficients(CodedImage& image) {
  JpegSegments segments(image.bytes);
  while (segments.next() != kScan) continue;
  constexpr std::size_t kLast = 4;
  if (segments.segment.size() == 6 && segments.byte(kLast) == 0)
    image.bytes[std::size_t(segments.segment.data() - image.bytes.data()) + kLast] = 63;
}

}  // namespace

std::vector<std::byte> decode_jpeg(CodedImage image, JpegProcess process) {
  const int precision = checked_precision(image, process);
  if (process != JpegProcess::lossless) say_all_coefficients(image);
  if (precision <= 8) return decoded<DJDecompressIJG8Bit>(image, precision);
  if (precision <= 12) return decoded<DJDecompressIJG12Bit>(image, precision);
  return decoded<DJDecompressIJG16Bit>(image, precision);
}

}  // namespace marrow::files
