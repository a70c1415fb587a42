// SPDX-License-Identifier: Apache-2.0
// JPEG (8 bits, grey or in colours), PNG and BMP. libpng is used directly, because ITK's reader ends the whole program
// if a file is cut off.
#include <png.h>

#include <cstdio>
// jpeglib.h needs stdio.h before it.
#include <jpeglib.h>

#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <string>
#include <string_view>

#include "codecs.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

/// The unsigned number of `width` bytes; 0 beyond the end.
std::uint32_t exif_number(std::string_view bytes, std::size_t at, std::size_t width, bool big_endian) {
  if (at > bytes.size() || width > bytes.size() - at) return 0;
  return std::uint32_t(number_in_bytes(bytes.substr(at, width), big_endian));
}

/// The Exif orientation (1 to 8) from the first directory of Exif data; 1 (not turned) if there is none.
std::uint32_t orientation_of(std::string_view exif) {
  const bool big_endian = exif.substr(0, 2) == "MM";
  if (!big_endian && exif.substr(0, 2) != "II") return 1;
  const std::size_t directory = exif_number(exif, 4, 4, big_endian),
                    entries = exif_number(exif, directory, 2, big_endian);
  for (std::size_t i = 0; i < entries && directory + 14 + 12 * i <= exif.size(); ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    if (exif_number(exif, entry, 2, big_endian) != 274) continue;
    const bool is_long = exif_number(exif, entry + 2, 2, big_endian) == 4;
    return exif_number(exif, entry + 8, is_long ? 4 : 2, big_endian);
  }
  return 1;
}

/// Throws Error, beginning with `what`, if Exif data (as PNG and JPEG hold them) say that the image is to be shown
/// turned or mirrored. Image viewers would turn it, but the readers here do not.
void check_not_turned(const std::string& what, std::string_view exif) {
  if (const auto orientation = orientation_of(exif); orientation >= 2 && orientation <= 8)
    throw Error(
        formatted("{}: is to be shown turned or mirrored (Exif Orientation {}), but its pixels are not; save it "
                  "turned, without Orientation",
                  what, orientation));
}

// libjpeg's errors. Its warnings, for example about data that end too early, are treated as errors.

struct JpegFailure {
  jpeg_error_mgr manager;
  std::jmp_buf back;  ///< errors jump here; no object with a destructor may live between setjmp and such a jump
  char text[JMSG_LENGTH_MAX];
};

inline void on_jpeg_error(j_common_ptr state) {
  JpegFailure& failure = *reinterpret_cast<JpegFailure*>(state->err);
  state->err->format_message(state, failure.text);
  std::longjmp(failure.back, 1);
}

inline void on_jpeg_message(j_common_ptr state, int level) {
  if (level < 0) on_jpeg_error(state);
}

/// A decompressor, which is freed at the end.
struct JpegReader {
  JpegReader() {
    state.err = jpeg_std_error(&failure.manager);
    failure.manager.error_exit = on_jpeg_error;
    failure.manager.emit_message = on_jpeg_message;
    jpeg_create_decompress(&state);
  }
  ~JpegReader() { jpeg_destroy_decompress(&state); }
  jpeg_decompress_struct state{};
  JpegFailure failure{};
};

/// Decompresses all rows after the header. Jumps back on an error.
inline void read_jpeg_rows(jpeg_decompress_struct& state, std::byte* to, std::size_t row_bytes) {
  jpeg_start_decompress(&state);
  while (state.output_scanline < state.output_height) {
    JSAMPROW row = reinterpret_cast<JSAMPROW>(to) + state.output_scanline * row_bytes;
    jpeg_read_scanlines(&state, &row, 1);
  }
  jpeg_finish_decompress(&state);
}

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

constexpr std::uint64_t kLargestPng = 1 << 30;

struct Source {
  std::string bytes;
  std::size_t at = 0;
  std::string fault;
};

void take(png_structp png, png_bytep out, std::size_t count) {
  Source& source = *static_cast<Source*>(png_get_io_ptr(png));
  if (source.bytes.size() - source.at < count) png_error(png, "it ends too early");
  std::memcpy(out, source.bytes.data() + source.at, count);
  source.at += count;
}

void on_error(png_structp png, png_const_charp message) {
  static_cast<Source*>(png_get_error_ptr(png))->fault = message;
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

struct Reader {
  explicit Reader(Source& source) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &source, on_error, on_warning);
    info = png_create_info_struct(png);
    if (!info) {
      png_destroy_read_struct(&png, nullptr, nullptr);
      throw std::bad_alloc();
    }
    png_set_read_fn(png, &source, take);
    // Only pixels are read. libpng would reserve the memory that a comment claims, and would only warn if that is much.
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
    // Text and colour profiles are not needed, but libpng decompresses them. Their number and size are limited.
    png_set_chunk_malloc_max(png, 4 << 20);
    png_set_chunk_cache_max(png, 16);
    png_set_user_limits(png, 100000, 100000);
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  png_structp png = nullptr;
  png_infop info = nullptr;
};

// In the next two functions no object with a destructor may live between setjmp and the calls that can jump back to it.

bool read_header(Reader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_info(reader.png, reader.info);
  png_set_expand(reader.png);  // palettes to colours, 1-4 bits to 8
  png_set_swap(reader.png);    // 16 bits are stored big-endian
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_rows(Reader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

void check_orientation(const std::string& what, std::string_view bytes) {
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const std::size_t length = std::size_t(number_in_bytes(bytes.substr(at, 4), true));
    if (length > bytes.size() - at - 12) return;  // cut off; libpng reports this if it needs the chunk
    if (bytes.substr(at + 4, 4) == "eXIf") check_not_turned(what, bytes.substr(at + 8, length));
    at += 12 + length;
  }
}

constexpr std::uint64_t kLargestBmp = 1 << 30;

struct BmpHeader {
  std::size_t pixels = 0, palette = 0, palette_step = 4;  ///< offsets in the file, and bytes of a colour
  long long width = 0, height = 0;                        ///< the height is negative if the upper row is the first
  std::uint32_t bits = 0, compression = 0;
  bool has_opacity = false;
};

/// The bytes of a file by their offsets. Throws Error beyond the end.
class BmpBytes {
 public:
  BmpBytes(std::string what, std::string_view bytes) : what_(std::move(what)), bytes_(bytes) {}
  std::uint32_t number(std::size_t at, std::size_t width) const {
    return std::uint32_t(number_in_bytes({reinterpret_cast<const char*>(part(at, width)), width}, false));
  }
  const std::uint8_t* part(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || count > bytes_.size() - at)
      throw Error(formatted("{}: is cut off or damaged: {} bytes expected, got {}; copy or export it again", what_,
                            at + count, bytes_.size()));
    return reinterpret_cast<const std::uint8_t*>(bytes_.data()) + at;
  }
  const std::string& what() const { return what_; }

 private:
  std::string what_;
  std::string_view bytes_;
};

[[noreturn]] void refuse_kind(const BmpBytes& bytes, const BmpHeader& header) {
  throw Error(formatted("{}: is a BMP of {} bits stored by method {}, which is not read; save it as PNG", bytes.what(),
                        header.bits, header.compression));
}

/// Checks where the bits of red, green, blue and opacity are, and whether there is an opacity.
void read_masks(const BmpBytes& bytes, std::size_t header_bytes, BmpHeader& header) {
  constexpr std::uint32_t kUsual[] = {0xFF0000, 0xFF00, 0xFF};
  for (std::size_t k = 0; k < 3; ++k)
    if (bytes.number(54 + 4 * k, 4) != kUsual[k]) refuse_kind(bytes, header);
  header.has_opacity = header_bytes >= 56 && bytes.number(66, 4) == 0xFF000000;
}

BmpHeader read_bmp_header(const BmpBytes& bytes) {
  if (std::memcmp(bytes.part(0, 2), "BM", 2) != 0)
    throw Error(bytes.what() + ": is not a BMP file, or is damaged at its start");
  BmpHeader header;
  header.pixels = bytes.number(10, 4);
  const std::size_t header_bytes = bytes.number(14, 4);
  const bool is_old = header_bytes == 12;
  const auto length = [&](std::size_t at) { return std::int32_t(bytes.number(at, is_old ? 2 : 4)); };
  header.width = length(18);
  header.height = length(is_old ? 20 : 22);
  header.bits = bytes.number(is_old ? 24 : 28, 2);
  header.compression = is_old ? 0 : bytes.number(30, 4);
  header.palette = 14 + header_bytes;
  header.palette_step = is_old ? 3 : 4;
  constexpr std::uint32_t kByMasks = 3;
  if (header.compression == kByMasks && header.bits == 32)
    read_masks(bytes, header_bytes, header);
  else if (header.compression != 0 ||
           (header.bits != 1 && header.bits != 4 && header.bits != 8 && header.bits != 24 && header.bits != 32))
    refuse_kind(bytes, header);
  return header;
}

/// Writes red, green and blue of one row, and the opacity if there is one.
void read_bmp_row(const BmpBytes& bytes, const BmpHeader& header, const std::uint8_t* row, std::uint8_t* to) {
  const std::uint32_t bits = header.bits;
  for (std::size_t u = 0; u < std::size_t(header.width); ++u) {
    const std::uint8_t* pixel = row + u * bits / 8;
    const std::uint8_t opacity = bits == 32 ? pixel[3] : 0;
    if (bits <= 8) {
      const std::uint32_t shift = 8 - bits - std::uint32_t(u * bits % 8), index = *pixel >> shift & ((1u << bits) - 1);
      const std::size_t place = header.palette + index * header.palette_step;
      if (place + header.palette_step > header.pixels)
        throw Error(formatted(
            "{}: is damaged: a pixel has the colour {}, which its palette does not have; copy or export it again",
            bytes.what(), index));
      pixel = bytes.part(place, header.palette_step);
    }
    for (std::size_t k = 0; k < 3; ++k) *to++ = pixel[2 - k];  // blue is the first
    if (header.has_opacity) *to++ = opacity;
  }
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

Samples read_png(const std::filesystem::path& path) {
  const std::string what = path.string();
  Source source;
  source.bytes = read_bytes(path, kLargestPng);
  if (source.bytes.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(source.bytes.data()), 0, 8))
    throw Error(what + ": is not a PNG file, or is damaged at its start");
  check_orientation(what, source.bytes);
  const auto fail = [&] {
    throw Error(what + ": cannot be read as PNG, it may be cut off or damaged (" + source.fault +
                "); copy or export it again");
  };
  Reader reader(source);
  if (!read_header(reader)) fail();
  Samples samples;
  samples.dimensions = 2;
  samples.size = {int(png_get_image_width(reader.png, reader.info)), int(png_get_image_height(reader.png, reader.info)),
                  1};
  samples.components = png_get_channels(reader.png, reader.info);
  samples.type = png_get_bit_depth(reader.png, reader.info) == 16 ? Samples::Type::u16 : Samples::Type::u8;
  const std::size_t row_bytes = png_get_rowbytes(reader.png, reader.info);
  check_size(what, {samples.size[0], samples.size[1], samples.components}, source.bytes.size());
  samples.bytes.resize(row_bytes * std::size_t(samples.size[1]));
  std::vector<png_bytep> rows;
  for (int v = 0; v < samples.size[1]; ++v)
    rows.push_back(reinterpret_cast<png_bytep>(samples.bytes.data() + row_bytes * std::size_t(v)));
  if (!read_rows(reader, rows.data())) fail();
  return samples;
}

// BMP without compression, as frame grabbers write it. It holds colours, which are equal in a grey image.

Samples read_bmp(const std::filesystem::path& path) {
  const std::string content = read_bytes(path, kLargestBmp);
  const BmpBytes bytes(path.string(), content);
  const BmpHeader header = read_bmp_header(bytes);
  const long long height = std::abs(header.height);
  Samples samples;
  samples.components = header.has_opacity ? 4 : 3;
  check_size(bytes.what(), {header.width, height, 1}, content.size());
  samples.dimensions = 2;
  samples.size = {int(header.width), int(height), 1};
  const std::size_t rows = std::size_t(height), row_bytes = (std::size_t(header.width) * header.bits + 31) / 32 * 4;
  const std::uint8_t* const stored = bytes.part(header.pixels, rows * row_bytes);
  const std::size_t row_samples = std::size_t(header.width) * std::size_t(samples.components);
  samples.bytes.resize(rows * row_samples);
  for (std::size_t v = 0; v < rows; ++v) {
    const std::size_t from = header.height > 0 ? rows - 1 - v : v;
    read_bmp_row(bytes, header, stored + from * row_bytes,
                 reinterpret_cast<std::uint8_t*>(samples.bytes.data()) + v * row_samples);
  }
  return samples;
}

}  // namespace marrow::files
