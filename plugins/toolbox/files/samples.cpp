// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/large_memory.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

static_assert(std::endian::native == std::endian::little, "samples are taken as they are where they are little-endian");

/// As floats these fit into 64 MB. So few samples are harmless at any compression ratio.
constexpr double kFewSamples = 1 << 24;

template <class T>
void convert(const std::byte* bytes, std::size_t count, bool swapped, float* values) {
  for (std::size_t i = 0; i < count; ++i) {
    std::array<std::byte, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes + i * sizeof(T), sizeof(T));
    if (swapped) std::reverse(raw.begin(), raw.end());
    values[i] = float(std::bit_cast<T>(raw));
  }
}

template <class T>
void convert_either(const std::byte* bytes, std::size_t count, bool swapped, float* values) {
  swapped ? convert<T>(bytes, count, true, values) : convert<T>(bytes, count, false, values);
}

void convert(Samples::Type type, const std::byte* bytes, std::size_t count, bool swapped, float* values) {
  using Type = Samples::Type;
  switch (type) {
    case Type::u8:
      return convert_either<std::uint8_t>(bytes, count, false, values);
    case Type::i8:
      return convert_either<std::int8_t>(bytes, count, false, values);
    case Type::u16:
      return convert_either<std::uint16_t>(bytes, count, swapped, values);
    case Type::i16:
      return convert_either<std::int16_t>(bytes, count, swapped, values);
    case Type::u32:
      return convert_either<std::uint32_t>(bytes, count, swapped, values);
    case Type::i32:
      return convert_either<std::int32_t>(bytes, count, swapped, values);
    case Type::u64:
      return convert_either<std::uint64_t>(bytes, count, swapped, values);
    case Type::i64:
      return convert_either<std::int64_t>(bytes, count, swapped, values);
    case Type::f32:
      return convert_either<float>(bytes, count, swapped, values);
    case Type::f64:
      return convert_either<double>(bytes, count, swapped, values);
  }
}

void scale(float* values, std::size_t count, double slope, double intercept) {
  if (slope == 1 && intercept == 0) return;
  for (std::size_t i = 0; i < count; ++i) values[i] = float(double(values[i]) * slope + intercept);
}

void convert(const StoredSamples& stored, const std::byte* bytes, std::size_t count, float* values) {
  convert(stored.type, bytes, count, stored.big_endian, values);
  scale(values, count, stored.slope, stored.intercept);
}

constexpr std::size_t kPart = 1 << 17;  // number of samples that are converted at once

void read_plain(const InputFile& file, const StoredSamples& stored, std::vector<float>& values) {
  const std::size_t width = bytes_each(stored.type);
  const std::uint64_t held = file.size() - std::min(file.size(), stored.begin);
  if (held != stored.count * width)
    throw Error(formatted("{}: is {}{} bytes of samples expected, got {}; copy or export it again",
                          file.path().string(),
                          held < stored.count * width ? "cut off or damaged: "
                                                      : "damaged, or its header tells of other samples than it holds: ",
                          stored.count * width, held));
  resize_large(values, stored.count);
  tbb::parallel_for(std::size_t(0), (stored.count + kPart - 1) / kPart, [&](std::size_t part) {
    const std::size_t first = part * kPart, count = std::min(kPart, stored.count - first);
    std::vector<std::byte> bytes(count * width);
    file.read(stored.begin + first * width, bytes.data(), bytes.size());
    convert(stored, bytes.data(), count, values.data() + first);
  });
}

void read_packed(const InputFile& file, const StoredSamples& stored, std::vector<float>& values) {
  const std::size_t width = bytes_each(stored.type);
  const auto stream = unpacked_bytes(file, stored.begin, file.size());
  std::vector<std::byte> bytes(kPart * width);
  for (std::uint64_t left = stored.skip; left > 0;) {
    const std::size_t count = std::size_t(std::min<std::uint64_t>(left, bytes.size()));
    take_all(*stream, file, bytes.data(), count);
    left -= count;
  }
  // Memory grows with the data that are there, not with the size that the header claims.
  for (std::size_t first = 0; first < stored.count; first += kPart) {
    const std::size_t count = std::min(kPart, stored.count - first);
    take_all(*stream, file, bytes.data(), count * width);
    if (values.size() < first + count)
      values.resize(first + count < stored.count / 8 ? std::max(first + count, 2 * values.size()) : stored.count);
    convert(stored, bytes.data(), count, values.data() + first);
  }
  expect_end(*stream, file);  // also verifies the checksum
  if (const std::uint64_t behind = stream->bytes_behind(); behind > 0)
    throw Error(formatted(
        "{}: is damaged: {} bytes follow the end of its compressed samples, none expected; copy or export it again",
        file.path().string(), behind));
}

/// Where a pixel is, for a message.
std::string place_of_pixel(const Samples& samples, std::size_t pixel) {
  const std::size_t width = std::size_t(samples.size[0]), height = std::size_t(samples.size[1]);
  return formatted("the pixel at column {} of row {}", pixel % width + 1, pixel / width % height + 1);
}

/// Keeps the first of several equal samples of each pixel. An opacity (the last of 2 or 4) must be full.
template <class T>
void keep_grey(const std::string& what, Samples& samples, T opaque) {
  const std::size_t each = std::size_t(samples.components), colours = each < 3 ? 1 : 3;
  for (std::size_t pixel = 0; pixel < samples.count(); ++pixel) {
    T values[4];
    std::memcpy(values, samples.bytes.data() + pixel * each * sizeof(T), each * sizeof(T));
    for (std::size_t k = 1; k < colours; ++k)
      if (values[k] != values[0])
        throw Error(formatted(
            "{}: has colours: {} has red {}, green {}, blue {}; an X-ray image is grey: save it as grey levels", what,
            place_of_pixel(samples, pixel), values[0], values[1], values[2]));
    if (each > colours && values[colours] != opaque)
      throw Error(
          formatted("{}: is transparent in places: {} has the opacity {}, expected {}; save it without transparency "
                    "(an alpha channel)",
                    what, place_of_pixel(samples, pixel), values[colours], opaque));
    std::memcpy(samples.bytes.data() + pixel * sizeof(T), values, sizeof(T));
  }
}

using namespace std::string_view_literals;

constexpr std::size_t kHeadBytes = 4096;

std::string head_of(const InputFile& file) {
  return file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), kHeadBytes)));
}

bool has_at(std::string_view head, std::size_t at, std::string_view mark) {
  return at <= head.size() && head.substr(at, mark.size()) == mark;
}

/// Many texts begin with the same two letters, so the length of the header must be a valid one.
bool is_bmp(std::string_view head) {
  return has_at(head, 0, "BM") && head.size() > 18 && "\x0C\x28\x34\x38\x40\x6C\x7C"sv.find(head[14]) != head.npos &&
         has_at(head, 15, "\0\0\0"sv);
}

bool is_nifti(std::string_view head) {
  if (has_at(head, 0, "\x5C\x01\0\0"sv) || has_at(head, 0, "\0\0\x01\x5C"sv))
    return has_at(head, 344, "n+1\0"sv) || has_at(head, 344, "ni1\0"sv);
  if (has_at(head, 0, "\x1C\x02\0\0"sv) || has_at(head, 0, "\0\0\x02\x1C"sv))
    return has_at(head, 4, "n+2\0"sv) || has_at(head, 4, "ni2\0"sv);
  return false;
}

/// A MetaImage has no mark: it is a text of fields, one of which is NDims.
bool is_meta_image(const std::string& head) {
  const std::string text = in_small_letters(head);
  const std::size_t at = text.find("ndims");
  if (at == text.npos || (at > 0 && text.find_last_of("\r\n", at) != at - 1)) return false;
  const std::size_t sign = text.find_first_not_of(" \t", at + 5);
  return sign != text.npos && (text[sign] == '=' || text[sign] == ':');
}

/// The first bytes of a compressed file's content; empty if they cannot be unpacked.
std::string unpacked_head(const InputFile& file) {
  std::string head(kHeadBytes, '\0');
  try {
    head.resize(bytes_of_gzip_or_plain(file)->take(head.data(), head.size()));
  } catch (const Error&) {  // its reader says what is wrong
    return {};
  }
  return head;
}

FileFormat format_by_content(const InputFile& file) {
  if (looks_like_dicom(file.path())) return FileFormat::dicom;  // its first 128 bytes may be those of a TIFF
  const std::string head = head_of(file);
  if (has_at(head, 0, "\x89PNG")) return FileFormat::png;
  for (const std::string_view mark : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (has_at(head, 0, mark)) return FileFormat::tiff;
  if (has_at(head, 0, "\xFF\xD8\xFF")) return FileFormat::jpeg;
  if (has_at(head, 0, "NRRD")) return FileFormat::nrrd;
  if (is_nifti(has_at(head, 0, "\x1F\x8B") ? unpacked_head(file) : head)) return FileFormat::nifti;
  if (is_bmp(head)) return FileFormat::bmp;
  return is_meta_image(head) ? FileFormat::meta_image : FileFormat::unknown;
}

FileFormat format_by_name(const std::filesystem::path& path) {
  static const std::map<std::string, FileFormat> kKnown{
      {".png", FileFormat::png},        {".tif", FileFormat::tiff},       {".tiff", FileFormat::tiff},
      {".jpg", FileFormat::jpeg},       {".jpeg", FileFormat::jpeg},      {".bmp", FileFormat::bmp},
      {".dcm", FileFormat::dicom},      {".dicom", FileFormat::dicom},    {".ima", FileFormat::dicom},
      {".mha", FileFormat::meta_image}, {".mhd", FileFormat::meta_image}, {".nrrd", FileFormat::nrrd},
      {".nhdr", FileFormat::nrrd},      {".nii", FileFormat::nifti}};
  std::string end = extension_of(path);
  if (end == ".gz") end = extension_of(path.stem()) == ".nii" ? ".nii" : "";
  const auto known = kKnown.find(end);
  return known == kKnown.end() ? FileFormat::unknown : known->second;
}

}  // namespace

std::size_t bytes_each(Samples::Type type) {
  static constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kBytes[int(type)];
}

void check_size(const std::string& what, const std::array<long long, 3>& size, std::uint64_t stored_bytes,
                double most_samples_per_byte) {
  for (const long long length : size)
    if (length < 1 || length > 100000)
      throw Error(formatted("{}: its header gives a size of {}; expected 1 to 100000", what, length));
  const double samples = double(size[0]) * double(size[1]) * double(size[2]);
  if (samples > std::max(kFewSamples, most_samples_per_byte * double(stored_bytes)))
    throw Error(
        formatted("{}: its header claims {} x {} x {} samples, but the file has only {} bytes; it is cut off or its "
                  "header is wrong, unless nearly all samples are alike: then save it without compression",
                  what, size[0], size[1], size[2], stored_bytes));
}

std::vector<float> read_floats(const InputFile& file, const StoredSamples& stored) {
  std::vector<float> values;
  stored.is_packed ? read_packed(file, stored, values) : read_plain(file, stored, values);
  return values;
}

std::vector<float> to_float(const Samples& samples) {
  std::vector<float> values(samples.count());
  convert(samples.type, samples.bytes.data(), values.size(), false, values.data());
  scale(values.data(), values.size(), samples.slope, samples.intercept);
  return values;
}

void make_grey(const std::string& what, Samples& samples) {
  if (samples.components == 1) return;
  const bool is_read = samples.type == Samples::Type::u8 || samples.type == Samples::Type::u16;
  if (samples.bytes.empty() || samples.components > 4 || !is_read)
    throw Error(
        formatted("{}: has {} channels; an X-ray image has one: save it as grey levels", what, samples.components));
  samples.type == Samples::Type::u8 ? keep_grey<std::uint8_t>(what, samples, 255)
                                    : keep_grey<std::uint16_t>(what, samples, 65535);
  samples.bytes.resize(samples.count() * bytes_each(samples.type));
  samples.components = 1;
}

FileFormat file_format(const std::filesystem::path& path) {
  const FileFormat told = format_by_content(InputFile(path, true));
  return told == FileFormat::unknown ? format_by_name(path) : told;
}

std::string name_of_other_format(const std::filesystem::path& path) {
  struct Known {
    std::size_t at;
    std::string_view mark;
    const char* name;
  };
  static constexpr Known kOthers[] = {
      {0, "P5\n", "a PNM picture"},           {0, "P6\n", "a PNM picture"},
      {0, "GIF8", "a GIF picture"},           {8, "WEBP", "a WebP picture"},
      {4, "jP  \r\n", "a JPEG 2000 picture"}, {0, "\xFF\x4F\xFF\x51", "a JPEG 2000 picture"},
      {4, "ftyphei", "a HEIC picture"},       {4, "ftypmif1", "a HEIC picture"},
      {4, "ftypavif", "an AVIF picture"},     {0, "%PDF", "a PDF document"},
      {0, "PK\x03\x04", "a ZIP archive"},     {0, "\x1F\x8B", "a file compressed by gzip, but no .nii.gz"},
      {0, "CDF\x01", "a MINC volume"},        {0, "\x89HDF", "an HDF5 file"}};
  const std::string head = head_of(InputFile(path, true));
  for (const Known& other : kOthers)
    if (has_at(head, other.at, other.mark)) return other.name;
  return {};
}

}  // namespace marrow::files
