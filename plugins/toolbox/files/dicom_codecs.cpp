// SPDX-License-Identifier: Apache-2.0
// The kinds of JPEG in DICOM files. Those of ITU T.81 (baseline, extended, lossless) are decoded by DCMTK's decoders
// for 8, 12 and 16 bits.
#include <charls/charls.h>
#include <dcmtk/config/osconfig.h>
#include <openjpeg.h>
// DCMTK wants its configuration first.
#include <dcmtk/dcmjpeg/djcparam.h>
#include <dcmtk/dcmjpeg/djdijg12.h>
#include <dcmtk/dcmjpeg/djdijg16.h>
#include <dcmtk/dcmjpeg/djdijg8.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>

#include "codecs.hpp"
#include "marrow/toolbox/files/input_file.hpp"

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

/// Checks the first segment (SIZ, table A.9), because OpenJPEG reserves memory for as many tiles as it claims.
void check_size_segment(const CodedImage& image) {
  constexpr std::size_t kBytes = 45;  // up to the description of the first component
  constexpr std::uint64_t kMostTiles = 4096;
  const std::string_view bytes = image.bytes;
  if (bytes.substr(0, 2) == "\xFF\xD8")
    throw CodecNotRead("its pixels are compressed by another kind of JPEG than the header says");
  if (bytes.substr(0, 4) != "\xFF\x4F\xFF\x51") throw CodecError("the pixels do not begin as JPEG 2000");
  if (bytes.size() < kBytes) throw CodecError("the compressed pixels end too early");
  const auto number = [&](std::size_t at, std::size_t width) { return number_in_bytes(bytes.substr(at, width), true); };
  const std::uint64_t right = number(8, 4), bottom = number(12, 4), left = number(16, 4), top = number(20, 4),
                      tile_columns = number(24, 4), tile_rows = number(28, 4);
  const int bits = (std::uint8_t(bytes[42]) & 0x7F) + 1;
  const bool is_signed = std::uint8_t(bytes[42]) >> 7 == 1;
  // Fewer bits than the header says are right where no sign depends on them.
  const int enough = is_signed == image.is_signed ? std::max(bits, image.bits_stored) : bits;
  check_coded(image, (long long)(right) - (long long)(left), (long long)(bottom) - (long long)(top), int(number(40, 2)),
              enough);
  const std::uint64_t capabilities = number(6, 2);  // Rsiz
  if (capabilities & 0x4000) throw CodecNotRead("its pixels are compressed by high-throughput JPEG 2000 (part 15)");
  if (capabilities & 0x8000) throw CodecNotRead("its pixels are compressed by JPEG 2000 with extensions (part 2)");
  if (bytes[43] != 1 || bytes[44] != 1) throw CodecError("the compressed pixels have only a part of their samples");
  if (is_signed && !image.is_signed) throw CodecError("the compressed pixels have a sign, the header says none");
  if (tile_columns == 0 || tile_rows == 0 || (right / tile_columns + 1) * (bottom / tile_rows + 1) > kMostTiles)
    throw CodecError("the compressed pixels tell of more than 4096 tiles");
}

/// Takes away the boxes of a JP2 file (ITU T.800, annex I), in which some programs put the codestream.
void unbox(CodedImage& image) {
  const std::string_view bytes = image.bytes;
  if (bytes.substr(0, 12) != std::string_view("\0\0\0\x0CjP  \r\n\x87\n", 12)) return;
  for (std::size_t at = 0; at + 8 <= bytes.size();) {
    const std::string_view type = bytes.substr(at + 4, 4);
    const std::size_t length = std::size_t(number_in_bytes(bytes.substr(at, 4), true));
    if (type == "jp2h" && bytes.substr(at + 8, length).find("pclr") != std::string_view::npos)
      throw CodecNotRead("its pixels are compressed numbers of colours in a table (JP2 with a palette)");
    if (type == "jp2c" && length != 1) {  // 1: a length of 8 bytes follows
      image.bytes = std::string(bytes.substr(at + 8, length == 0 ? bytes.npos : std::max<std::size_t>(length, 8) - 8));
      return;
    }
    if (length < 8) break;
    at += length;
  }
  throw CodecError("no JPEG 2000 lies in the boxes of a JP2 file around the pixels");
}

/// Bytes that OpenJPEG reads one after the other.
struct Source {
  std::string_view bytes;
  std::size_t at = 0;
};

OPJ_SIZE_T read_source(void* to, OPJ_SIZE_T count, void* of) {
  Source& source = *static_cast<Source*>(of);
  count = std::min(count, source.bytes.size() - source.at);
  if (count == 0) return OPJ_SIZE_T(-1);
  std::memcpy(to, source.bytes.data() + source.at, count);
  source.at += count;
  return count;
}

OPJ_OFF_T skip_source(OPJ_OFF_T count, void* of) {
  Source& source = *static_cast<Source*>(of);
  if (count < 0 || std::size_t(count) > source.bytes.size() - source.at) return -1;
  source.at += std::size_t(count);
  return count;
}

OPJ_BOOL seek_source(OPJ_OFF_T place, void* of) {
  Source& source = *static_cast<Source*>(of);
  if (place < 0 || std::size_t(place) > source.bytes.size()) return OPJ_FALSE;
  source.at = std::size_t(place);
  return OPJ_TRUE;
}

/// Keeps the first message. OpenJPEG warns where data are missing and goes on, so a warning is an error here.
void keep_message(const char* text, void* to) {
  std::string& message = *static_cast<std::string*>(to);
  if (message.empty()) message = text;
  while (!message.empty() && message.back() == '\n') message.pop_back();
}

/// What OpenJPEG made, and how it is freed.
template <class T>
using Owned = std::unique_ptr<T, void (*)(T*)>;

Owned<opj_image_t> decoded_picture(const CodedImage& image) {
  Source source{image.bytes};
  std::string message;
  const Owned<opj_codec_t> codec(opj_create_decompress(OPJ_CODEC_J2K), opj_destroy_codec);
  const Owned<opj_stream_t> stream(opj_stream_create(1 << 16, OPJ_TRUE), opj_stream_destroy);
  opj_stream_set_user_data(stream.get(), &source, nullptr);
  opj_stream_set_user_data_length(stream.get(), image.bytes.size());
  opj_stream_set_read_function(stream.get(), read_source);
  opj_stream_set_skip_function(stream.get(), skip_source);
  opj_stream_set_seek_function(stream.get(), seek_source);
  opj_set_warning_handler(codec.get(), keep_message, &message);
  opj_set_error_handler(codec.get(), keep_message, &message);
  opj_dparameters_t parameters;
  opj_set_default_decoder_parameters(&parameters);
  opj_image_t* made = nullptr;
  bool is_read = opj_setup_decoder(codec.get(), &parameters) && opj_read_header(stream.get(), codec.get(), &made);
  Owned<opj_image_t> picture(made, opj_image_destroy);
  is_read = is_read && opj_decode(codec.get(), stream.get(), made) && opj_end_decompress(codec.get(), stream.get());
  if (!is_read || !message.empty())
    throw CodecError("the compressed pixels cannot be decoded (" + (message.empty() ? "OpenJPEG" : message) + ")");
  return picture;
}

}  // namespace

std::vector<std::byte> decode_jpeg(CodedImage image, JpegProcess process) {
  const int precision = checked_precision(image, process);
  if (process != JpegProcess::lossless) say_all_coefficients(image);
  if (precision <= 8) return decoded<DJDecompressIJG8Bit>(image, precision);
  if (precision <= 12) return decoded<DJDecompressIJG12Bit>(image, precision);
  return decoded<DJDecompressIJG16Bit>(image, precision);
}

// JPEG-LS (ITU T.87) in DICOM files, by CharLS.

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

// JPEG 2000 (ITU T.800) in DICOM files, by OpenJPEG.

std::vector<std::byte> decode_jpeg_2000(CodedImage image) {
  unbox(image);
  check_size_segment(image);
  const Owned<opj_image_t> picture = decoded_picture(image);
  const opj_image_comp_t& only = picture->comps[0];
  if (picture->numcomps != 1 || !only.data || int(only.w) != image.columns || int(only.h) != image.rows)
    throw CodecError("the compressed pixels tell of two sizes");
  const std::size_t width = std::size_t(image.bits_allocated / 8);
  std::vector<std::byte> samples(image.count() * width);
  for (std::size_t i = 0; i < image.count(); ++i) std::memcpy(samples.data() + i * width, only.data + i, width);
  return samples;
}

}  // namespace marrow::files
