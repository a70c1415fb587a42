// SPDX-License-Identifier: Apache-2.0
// Single frames of a DICOM file, decoded.
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string_view>

#include "codecs.hpp"
#include "dicom_pixels.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

/// Unpacks PackBits data until there are `bytes` bytes or no data are left. Returns the number of bytes. Returns 0 if
/// there are more than `bytes`, if a run is cut off, or if more than one byte of filling follows.
inline std::size_t unpack_packbits(std::string_view packed, std::byte* to, std::size_t bytes) {
  std::size_t done = 0, at = 0;
  while (done < bytes && at < packed.size()) {
    const int byte = static_cast<unsigned char>(packed[at++]), control = byte < 128 ? byte : byte - 256;
    if (control == -128) continue;
    const std::size_t count = std::size_t(control < 0 ? 1 - control : 1 + control), stored = control < 0 ? 1 : count;
    if (count > bytes - done || stored > packed.size() - at) return 0;
    control < 0 ? std::memset(to + done, packed[at], count) : std::memcpy(to + done, packed.data() + at, count);
    done += count;
    at += stored;
  }
  return packed.size() - at > 1 ? 0 : done;
}

/// When the other bits are removed, such padding would become another value, possibly that of bone.
void check_padding(const DicomPixels& pixels, const std::vector<std::byte>& bytes) {
  if (!pixels.padding_beyond_bits || pixels.bits_allocated != 16) return;
  for (std::size_t at = 0; at < bytes.size(); at += 2) {
    std::uint16_t word;
    std::memcpy(&word, bytes.data() + at, 2);
    if (word == *pixels.padding_beyond_bits)
      throw Error(
          formatted("{}: has pixels of the value {} (PixelPaddingValue), which the {} bits that its pixels have cannot "
                    "hold; export it again",
                    pixels.path.string(), word, pixels.bits_stored));
  }
}

CodedImage coded_frame(const DicomPixels& pixels, const InputFile& file, int frame) {
  CodedImage image{{}, pixels.columns, pixels.rows, pixels.bits_stored, pixels.bits_allocated, pixels.is_signed};
  for (std::size_t i = pixels.first_part_of_frame[std::size_t(frame - 1)];
       i < pixels.first_part_of_frame[std::size_t(frame)]; ++i)
    image.bytes += file.text(pixels.frame_parts[i].begin, std::size_t(pixels.frame_parts[i].bytes));
  check_size(pixels.path.string(), {pixels.columns, pixels.rows, 1}, image.bytes.size(), 100);
  return image;
}

std::vector<std::byte> decoded(const DicomPixels& pixels, const CodedImage& image) {
  try {
    const std::string& syntax = pixels.transfer_syntax;
    if (syntax == "1.2.840.10008.1.2.5") return decode_rle(image);
    if (syntax == "1.2.840.10008.1.2.4.50") return decode_jpeg(image, JpegProcess::baseline);
    if (syntax == "1.2.840.10008.1.2.4.51") return decode_jpeg(image, JpegProcess::extended);
    if (syntax == "1.2.840.10008.1.2.4.80") return decode_jpeg_ls(image, true);
    if (syntax == "1.2.840.10008.1.2.4.81") return decode_jpeg_ls(image, false);
    if (syntax == "1.2.840.10008.1.2.4.90" || syntax == "1.2.840.10008.1.2.4.91") return decode_jpeg_2000(image);
    return decode_jpeg(image, JpegProcess::lossless);
  } catch (const CodecNotRead& error) {
    throw Error(pixels.path.string() + ": " + error.what() + "; convert it: gdcmconv --raw IN OUT");
  } catch (const CodecError& error) {
    throw Error(pixels.path.string() + ": is cut off or damaged: " + error.what() + "; copy or export it again");
  }
}

/// Bytes of the file, or of its unpacked content.
std::vector<std::byte> bytes_at(const DicomPixels& pixels, const InputFile& file, std::uint64_t begin,
                                std::size_t count) {
  std::vector<std::byte> bytes(count);
  if (pixels.unpacked)
    std::memcpy(bytes.data(), pixels.unpacked->data() + begin, count);
  else
    file.read(begin, bytes.data(), count);
  return bytes;
}

/// Pixels of one byte in swapped pairs, of which the first or last pair may belong to two frames.
std::vector<std::byte> swapped_back(const DicomPixels& pixels, const InputFile& file, std::uint64_t first,
                                    std::size_t count) {
  const std::uint64_t begin = first & ~std::uint64_t(1), end = (first + count + 1) & ~std::uint64_t(1);
  std::vector<std::byte> pairs = bytes_at(pixels, file, pixels.frame_parts[0].begin + begin, std::size_t(end - begin));
  for (std::size_t at = 0; at < pairs.size(); at += 2) std::swap(pairs[at], pairs[at + 1]);
  const auto from = pairs.begin() + std::ptrdiff_t(first - begin);
  return {from, from + std::ptrdiff_t(count)};
}

std::vector<std::byte> plain_frame(const DicomPixels& pixels, const InputFile& file, int frame) {
  const std::size_t width = std::size_t(pixels.bits_allocated / 8);
  const std::size_t count =
      std::size_t(pixels.columns) * std::size_t(pixels.rows) * width * std::size_t(pixels.channels);
  const std::uint64_t first = std::uint64_t(frame - 1) * count;
  if (pixels.bytes_are_swapped) return swapped_back(pixels, file, first, count);
  std::vector<std::byte> bytes = bytes_at(pixels, file, pixels.frame_parts[0].begin + first, count);
  if (pixels.big_endian && width > 1)
    for (std::size_t at = 0; at < bytes.size(); at += width) std::reverse(bytes.data() + at, bytes.data() + at + width);
  return bytes;
}

/// Puts red, green and blue of a pixel side by side.
std::vector<std::byte> side_by_side(const std::vector<std::byte>& planes, std::size_t width) {
  std::vector<std::byte> pixels(planes.size());
  const std::size_t count = planes.size() / (3 * width);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      std::memcpy(pixels.data() + (3 * i + k) * width, planes.data() + (k * count + i) * width, width);
  return pixels;
}

/// Keeps only the stored bits. The bits above them may hold overlays.
template <class T>
void keep_stored(const DicomPixels& pixels, std::vector<std::byte>& bytes) {
  const T mask = T((std::uint64_t(1) << pixels.bits_stored) - 1),
          sign = T(std::uint64_t(1) << (pixels.bits_stored - 1));
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(T)) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    value &= mask;
    if (pixels.is_signed && (value & sign)) value = T(value | T(~mask));
    std::memcpy(bytes.data() + at, &value, sizeof(T));
  }
}

}  // namespace

void check_coded(const CodedImage& image, long long columns, long long rows, int channels, int bits) {
  if (rows != image.rows || columns != image.columns)
    throw CodecError(formatted("the compressed pixels are of {} x {}, the header says {} x {}", columns, rows,
                               image.columns, image.rows));
  if (channels != 1)
    throw CodecError(formatted("the compressed pixels have {} values each, the header says 1", channels));
  if (bits < image.bits_stored || bits > image.bits_allocated || bits < 2)
    throw CodecError(formatted("the compressed pixels have {} bits, the header says {} of {}", bits, image.bits_stored,
                               image.bits_allocated));
}

std::vector<std::byte> as_allocated(const CodedImage& image, std::vector<std::byte> samples, int bits) {
  if (bits > 8 || image.bits_allocated == 8) return samples;
  std::vector<std::byte> wide(2 * samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) wide[2 * i] = samples[i];
  return wide;
}

std::vector<std::byte> decode_rle(const CodedImage& image) {
  const std::size_t count = std::size_t(image.columns) * std::size_t(image.rows),
                    width = std::size_t(image.bits_allocated / 8);
  const auto word = [&](std::size_t at) {
    return std::size_t(number_in_bytes(std::string_view(image.bytes).substr(at, 4), false));
  };
  if (image.bytes.size() < 64 || word(0) != width)
    throw CodecError("the compressed pixels are not of as many parts as a pixel has bytes");
  std::vector<std::byte> bytes(count * width), part(count);
  for (std::size_t k = 0; k < width; ++k) {  // the high bytes of all pixels come first
    const std::size_t begin = word(4 + 4 * k), end = k + 1 < width ? word(8 + 4 * k) : image.bytes.size();
    if (begin < 64 || begin > end || end > image.bytes.size())
      throw CodecError("the compressed pixels are damaged at their start");
    if (unpack_packbits(std::string_view(image.bytes).substr(begin, end - begin), part.data(), count) != count)
      throw CodecError("the compressed pixels are too few");
    for (std::size_t i = 0; i < count; ++i) bytes[i * width + width - 1 - k] = part[i];
  }
  return bytes;
}

Samples read_dicom_frame(const DicomPixels& pixels, int frame) {
  const InputFile file(pixels.path);
  if (file.size() != pixels.file_bytes)
    throw Error(pixels.path.string() + ": was changed while it was read; try again when nothing writes it");
  Samples samples;
  samples.dimensions = 2;
  samples.size = {pixels.columns, pixels.rows, 1};
  using Type = Samples::Type;
  samples.type = pixels.bits_allocated == 8    ? (pixels.is_signed ? Type::i8 : Type::u8)
                 : pixels.bits_allocated == 16 ? (pixels.is_signed ? Type::i16 : Type::u16)
                                               : (pixels.is_signed ? Type::i32 : Type::u32);
  samples.components = pixels.channels;
  if (pixels.first_part_of_frame.empty())
    samples.bytes = plain_frame(pixels, file, frame);
  else if (pixels.bits_allocated == 32 && pixels.transfer_syntax != "1.2.840.10008.1.2.5")
    throw Error(pixels.path.string() + ": is damaged: JPEG has no pixels of 32 bits; copy or export it again");
  else
    samples.bytes = decoded(pixels, coded_frame(pixels, file, frame));
  if (pixels.planes_are_apart) samples.bytes = side_by_side(samples.bytes, bytes_each(samples.type));
  if (pixels.bits_stored == pixels.bits_allocated) return samples;
  check_padding(pixels, samples.bytes);
  if (pixels.bits_allocated == 8) keep_stored<std::uint8_t>(pixels, samples.bytes);
  if (pixels.bits_allocated == 16) keep_stored<std::uint16_t>(pixels, samples.bytes);
  if (pixels.bits_allocated == 32) keep_stored<std::uint32_t>(pixels, samples.bytes);
  return samples;
}

}  // namespace marrow::files
