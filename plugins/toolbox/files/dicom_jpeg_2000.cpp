// SPDX-License-Identifier: Apache-2.0
// JPEG 2000 (ITU T.800) in DICOM files, by OpenJPEG.
#include <openjpeg.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>

#include "codecs.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {
namespace {

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
