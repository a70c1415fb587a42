// SPDX-License-Identifier: Apache-2.0
#include "dicom_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

using Kind = DicomTag::Kind;
constexpr DicomTag kPlanes{0x0028, 0x0006, "PlanarConfiguration", Kind::us};
constexpr DicomTag kFrames{0x0028, 0x0008, "NumberOfFrames"};
constexpr DicomTag kAllocated{0x0028, 0x0100, "BitsAllocated", Kind::us};
constexpr DicomTag kStored{0x0028, 0x0101, "BitsStored", Kind::us};
constexpr DicomTag kHighBit{0x0028, 0x0102, "HighBit", Kind::us};
constexpr DicomTag kIntercept{0x0028, 0x1052, "RescaleIntercept"};

[[noreturn]] void damaged(const std::filesystem::path& path, const std::string& fault) {
  throw Error(path.string() + ": is cut off or damaged: " + fault + "; copy or export it again");
}

int whole(const DicomHeader& header, const DicomTag& tag, std::optional<int> missing = {}) {
  const auto given = header.number(tag);
  if (!given && !missing)
    throw Error(header.path().string() + ": its header has no " + tag.text() +
                ", without which its pixels cannot be understood; copy or export it again");
  const double value = given ? *given : *missing;
  if (value != std::floor(value) || std::abs(value) > 1e9)
    damaged(header.path(), formatted("{} is {:f}; expected a whole number", tag.text(), value));
  return int(value);
}

void read_size(const DicomHeader& header, DicomPixels& pixels) {
  pixels.rows = whole(header, kRows, 0);
  pixels.columns = whole(header, kColumns, 0);
  if (pixels.rows < 1 || pixels.columns < 1)
    throw Error(pixels.path.string() + ": its header does not say how large the image is; export it again");
  pixels.frames = std::max(1, whole(header, kFrames, 1));
  pixels.channels = whole(header, kSamplesPerPixel);
  if (pixels.channels < 1 || pixels.channels > 4)
    damaged(pixels.path, formatted("its header tells of {} values per pixel", pixels.channels));
  const std::string photometric = header.text(kPhotometric).value_or("");
  if (photometric.rfind("PALETTE", 0) == 0)
    throw Error(pixels.path.string() + ": its pixels are numbers of colours in a table (" + kPhotometric.text() +
                " is PALETTE COLOR), not grey levels; export it as MONOCHROME2");
  if (pixels.channels == 1 && photometric != "MONOCHROME1" && photometric != "MONOCHROME2")
    throw Error(pixels.path.string() + ": " + kPhotometric.text() +
                (photometric.empty() ? " is missing" : " is '" + shown(photometric) + "'") +
                "; expected MONOCHROME1 or MONOCHROME2, as grey pixels have: copy or export it again");
}

/// A plan or a report has no pixels, and is sound.
void check_is_image(const DicomFile& file, const DicomHeader& header) {
  if (file.has_pixels()) return;
  if (header.has(kRows)) damaged(file.path(), "it has no pixels");
  const std::string modality = header.text(kModality).value_or("");
  throw Error(file.path().string() + ": holds no image" + (modality.empty() ? "" : ", it is of modality " + modality) +
              "; expected a CT slice or an X-ray image");
}

/// There must be one item per frame in the functional groups. Otherwise values of another frame would be used.
void check_groups(const DicomFile& file, const DicomPixels& pixels) {
  const DicomElement* groups = find_element(pixels.path, file.elements(), kFrameGroups);
  if (groups && groups->items.size() != std::size_t(pixels.frames))
    damaged(pixels.path, formatted("it has {}, but values for {} (PerFrameFunctionalGroupsSequence)",
                                   counted(pixels.frames, "frame"), groups->items.size()));
}

void read_bits(const DicomHeader& header, DicomPixels& pixels) {
  pixels.bits_allocated = whole(header, kAllocated);
  pixels.bits_stored = whole(header, kStored);
  const int allocated = pixels.bits_allocated, stored = pixels.bits_stored, high = whole(header, kHighBit);
  const int representation = whole(header, kPixelRepresentation);
  if ((allocated != 8 && allocated != 16 && allocated != 32) || stored < 1 || stored > allocated || high != stored - 1)
    throw Error(
        formatted("{}: its pixels have {} of {} bits, the highest being {}, which is not read; expected 8, 16 or 32 "
                  "bits, the highest being the last that is stored: export it with 16",
                  pixels.path.string(), stored, allocated, high));
  if (representation != 0 && representation != 1)
    damaged(pixels.path, kPixelRepresentation.text() + " is neither 0 nor 1");
  pixels.is_signed = representation == 1;
  const auto slope = header.number(kRescaleSlope), intercept = header.number(kIntercept);
  pixels.slope = slope.value_or(1);
  pixels.intercept = intercept.value_or(0);
  pixels.gives_slope = slope.has_value();
  pixels.gives_intercept = intercept.has_value();
  if (pixels.slope == 0) damaged(pixels.path, kRescaleSlope.text() + " is 0");
}

/// The meaning of a value of 16 bits if only `bits_stored` of them count. std::nullopt if it needs more bits.
std::optional<double> value_of_stored_bits(const DicomPixels& pixels, double value) {
  const int bits = pixels.bits_stored, word = std::uint16_t(int(value));
  if (bits >= 16) return value;
  if (word >> bits == 0) return pixels.is_signed && word >> (bits - 1) == 1 ? word - (1 << bits) : word;
  if (pixels.is_signed && value >= -double(1 << (bits - 1)) && value < 0) return value;
  return std::nullopt;
}

void read_padding(const DicomHeader& header, DicomPixels& pixels) {
  const Kind kind = pixels.is_signed ? Kind::ss : Kind::us;
  const auto value = header.number({0x0028, 0x0120, "PixelPaddingValue", kind});
  if (!value) return;
  const double limit = header.number({0x0028, 0x0121, "PixelPaddingRangeLimit", kind}).value_or(*value);
  const auto from = value_of_stored_bits(pixels, *value), to = value_of_stored_bits(pixels, limit);
  if (from && to)
    pixels.padding = {std::min(*from, *to), std::max(*from, *to)};
  else
    pixels.padding_beyond_bits = std::uint16_t(int(*value));
}

/// The first part of each frame by the table of offsets. The offsets count from the first part's item.
std::vector<std::size_t> parts_by_table(const DicomFile& file, const DicomPixels& pixels) {
  const DicomSpan& table = file.offset_table();
  std::vector<std::size_t> first;
  if (table.bytes != std::uint64_t(pixels.frames) * 4 || pixels.frame_parts.empty()) return first;
  FileWindow window(file.file());
  const std::uint64_t origin = pixels.frame_parts[0].begin - 8;
  for (std::uint64_t i = 0; i < table.bytes / 4; ++i) {
    const std::uint64_t begin = origin + window.number(table.begin + 4 * i, 4, false) + 8;
    const auto part = std::lower_bound(pixels.frame_parts.begin(), pixels.frame_parts.end(), begin,
                                       [](const DicomSpan& span, std::uint64_t place) { return span.begin < place; });
    if (part == pixels.frame_parts.end() || part->begin != begin) return {};
    const std::size_t index = std::size_t(part - pixels.frame_parts.begin());
    if (first.empty() ? index != 0 : index <= first.back()) return {};
    first.push_back(index);
  }
  first.push_back(pixels.frame_parts.size());
  return first;
}

/// The first part of each frame by the mark with which every JPEG begins. A file need not have a table of offsets.
std::vector<std::size_t> parts_by_jpeg_start(const DicomFile& file, const DicomPixels& pixels) {
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < pixels.frame_parts.size(); ++i)
    if (pixels.frame_parts[i].bytes >= 2 && file.file().text(pixels.frame_parts[i].begin, 2) == "\xFF\xD8")
      first.push_back(i);
  if (first.size() != std::size_t(pixels.frames) || first[0] != 0) return {};
  first.push_back(pixels.frame_parts.size());
  return first;
}

void find_frames(const DicomFile& file, DicomPixels& pixels) {
  const std::size_t parts = pixels.frame_parts.size(), frames = std::size_t(pixels.frames);
  if (parts < frames)
    damaged(pixels.path,
            formatted("its header tells of {} frames, but there are {} parts of compressed pixels", frames, parts));
  if (parts == frames)
    for (std::size_t i = 0; i <= frames; ++i) pixels.first_part_of_frame.push_back(i);
  else if (frames == 1)
    pixels.first_part_of_frame = {0, parts};
  else
    pixels.first_part_of_frame = parts_by_table(file, pixels);
  if (pixels.first_part_of_frame.empty()) pixels.first_part_of_frame = parts_by_jpeg_start(file, pixels);
  if (pixels.first_part_of_frame.empty())
    throw Error(
        formatted("{}: does not say which of its {} parts of compressed pixels make up a frame; convert it: gdcmconv "
                  "--raw IN OUT",
                  pixels.path.string(), parts));
}

/// Whether the bytes after the pixels are only filling: one byte to make the length even, or up to 512 zeros. Anything
/// else would be pixels that the header does not mention.
bool is_filled(const DicomFile& file, std::uint64_t pixel_bytes) {
  const DicomSpan& part = file.pixel_parts()[0];
  const std::uint64_t more = part.bytes - pixel_bytes;
  if (more == 1 && pixel_bytes % 2 == 1) return true;
  return more <= 512 && file.text({part.begin + pixel_bytes, more}) == std::string(more, '\0');
}

void check_plain(const DicomFile& file, const DicomPixels& pixels) {
  const double held = file.pixel_parts().empty() ? 0 : double(file.pixel_parts()[0].bytes);
  // Colours may be subsampled (YBR_FULL_422), so the bytes of one channel are the least that is expected.
  const double expected =
      double(pixels.rows) * pixels.columns * pixels.frames * pixels.bits_allocated / 8 * (pixels.is_plain_rgb ? 3 : 1);
  const bool is_too_much = pixels.channels == 1 && held > expected && !is_filled(file, std::uint64_t(expected));
  if (expected > held || is_too_much)
    damaged(pixels.path, formatted("its header tells of {} bytes of pixels, but there are {}", std::int64_t(expected),
                                   std::int64_t(held)));
}

constexpr DicomTag kTable{0x0028, 0x3000, "ModalityLUTSequence"};
constexpr DicomTag kIntensityTables{0x0028, 0x9422, "PixelIntensityRelationshipLUTSequence"};
constexpr DicomTag kTableFunction{0x0028, 0x9474, "LUTFunction"};
constexpr DicomTag kLayout{0x0028, 0x3002, "LUTDescriptor"};
constexpr DicomTag kTableType{0x0028, 0x3004, "ModalityLUTType"};
constexpr DicomTag kEntries{0x0028, 0x3006, "LUTData"};

[[noreturn]] void damaged_table(const DicomHeader& header, const std::string& fault) {
  throw Error(header.path().string() + ": is damaged: in the table for its values (" +
              (header.has(kTable) ? kTable : kIntensityTables).text() + ") " + fault + "; copy or export it again");
}

/// The item with the table for values: that of all images, or, where values are logarithms, the one of an enhanced XA
/// that makes them linear (PS3.3 C.7.6.16.2.13). nullptr if there is none.
const DicomElements* item_of_table(const DicomFile& file, const DicomHeader& header) {
  if (const auto* items = header.items(kTable)) {
    if (items->size() != 1) damaged_table(header, formatted("{} items stand where one should", items->size()));
    return &items->front();
  }
  const auto* items = header.text(kIntensity).value_or("") == "LOG" ? header.items(kIntensityTables) : nullptr;
  const DicomElements* found = nullptr;
  for (std::size_t i = 0; items && i < items->size(); ++i) {
    const DicomElement* function = find_element(header.path(), (*items)[i], kTableFunction.code());
    if (!function || function->value.bytes > 64 || without_padding(file.text(function->value)) != "TO_LINEAR") continue;
    if (found) damaged_table(header, "TO_LINEAR stands twice (" + kTableFunction.text() + ")");
    found = &(*items)[i];
  }
  return found;
}

double value_of(const DicomPixels& pixels, double stored) {
  return pixels.table ? pixels.table->value_of(stored) : pixels.slope * stored + pixels.intercept;
}

template <class T>
void scale(const DicomPixels& pixels, const std::vector<std::byte>& bytes, float* values) {
  const double slope = pixels.slope, intercept = pixels.intercept;
  for (std::size_t i = 0; i < bytes.size() / sizeof(T); ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    values[i] = float(pixels.table ? pixels.table->value_of(double(value)) : slope * double(value) + intercept);
  }
}

/// The table in the header; std::nullopt if there is none. Throws Error if it contradicts itself.
std::optional<DicomTable> read_dicom_table(const DicomFile& file, const DicomHeader& header) {
  const DicomElements* const item = item_of_table(file, header);
  if (!item) return std::nullopt;
  const auto bytes = [&](const DicomTag& tag, std::uint64_t most) {
    const DicomElement* element = find_element(header.path(), *item, tag.code());
    if (!element || element->value.bytes == 0) damaged_table(header, tag.text() + " is missing");
    if (element->value.bytes > most)
      damaged_table(header, formatted("{} has {} bytes", tag.text(), element->value.bytes));
    return std::pair(file.text(element->value), element);
  };
  const auto [layout, given] = bytes(kLayout, 6);
  if (layout.size() != 6) damaged_table(header, kLayout.text() + " has not 3 numbers");
  const auto word = [&](const std::string& text, std::size_t at) {
    return std::uint16_t(number_in_bytes(std::string_view(text).substr(at, 2), given->big_endian));
  };
  const std::string_view kind(given->kind.data(), given->kind.size());
  const bool is_signed = kind == "SS" || (kind != "US" && header.number(kPixelRepresentation).value_or(0) == 1);
  const std::size_t count = word(layout, 0) == 0 ? 65536 : word(layout, 0);
  DicomTable table;
  table.first = is_signed ? double(std::int16_t(word(layout, 2))) : double(word(layout, 2));
  table.bits = word(layout, 4);
  if (table.bits < 8 || table.bits > 16) damaged_table(header, formatted("entries have {} bits", table.bits));
  const std::string entries = bytes(kEntries, 2 * 65536).first;
  const bool are_bytes = table.bits == 8 && entries.size() == count + count % 2;
  if (!are_bytes && entries.size() != 2 * count)
    damaged_table(header, formatted("{} entries are told, but there are {} bytes of them", count, entries.size()));
  for (std::size_t i = 0; i < count; ++i)
    table.entries.push_back(are_bytes ? std::uint8_t(entries[i]) : word(entries, 2 * i));
  if (*std::max_element(table.entries.begin(), table.entries.end()) >> table.bits != 0)
    damaged_table(header, formatted("an entry has more than {} bits", table.bits));
  const DicomElement* type = find_element(header.path(), *item, kTableType.code());
  if (type && type->value.bytes <= 64) table.type = without_padding(file.text(type->value));
  return table;
}

}  // namespace

DicomPixels read_dicom_pixels(const DicomFile& file, int frame) {
  const DicomHeader header(file, frame);
  DicomPixels pixels;
  pixels.path = file.path();
  pixels.file_bytes = file.file().size();
  pixels.transfer_syntax = file.transfer_syntax();
  pixels.big_endian = file.is_big_endian();
  if (header.text(kObjectClass).value_or("").rfind("1.2.840.10008.5.1.4.1.1.481.2", 0) == 0)
    throw Error(pixels.path.string() + ": holds a dose of radiotherapy; expected a CT slice or an X-ray image");
  check_is_image(file, header);
  read_size(header, pixels);
  read_bits(header, pixels);
  check_groups(file, pixels);
  if (pixels.channels == 1) read_padding(header, pixels);
  pixels.table = read_dicom_table(file, header);
  const bool should_be_compressed =
      pixels.transfer_syntax.rfind("1.2.840.10008.1.2.4", 0) == 0 || pixels.transfer_syntax == "1.2.840.10008.1.2.5";
  if (file.is_compressed() != should_be_compressed)
    damaged(pixels.path, "its pixels are not written as its transfer syntax says");
  pixels.bytes_are_swapped = pixels.big_endian && pixels.bits_allocated == 8 && file.pixels_are_words();
  pixels.is_plain_rgb = pixels.channels == 3 && header.text(kPhotometric).value_or("") == "RGB" &&
                        !file.is_compressed() && !pixels.is_signed;
  pixels.planes_are_apart = pixels.is_plain_rgb && header.number(kPlanes).value_or(0) == 1;
  pixels.unpacked = file.unpacked();
  pixels.frame_parts = file.pixel_parts();
  file.is_compressed() ? find_frames(file, pixels) : check_plain(file, pixels);
  return pixels;
}

DicomPixels read_dicom_pixels(const std::filesystem::path& path, int frame) {
  return read_dicom_pixels(DicomFile(path), frame);
}

double DicomTable::value_of(double stored) const {
  return entries[std::size_t(std::clamp(stored - first, 0.0, double(entries.size() - 1)))];
}

void make_padding_air(const DicomPixels& pixels, float* values, std::size_t count) {
  constexpr float kAir_hu = -1000;
  if (!pixels.padding) return;
  const auto scaled = [&](double stored) { return float(value_of(pixels, stored)); };
  const auto [lowest, highest] = std::minmax({scaled((*pixels.padding)[0]), scaled((*pixels.padding)[1])});
  for (std::size_t i = 0; i < count; ++i)
    if (values[i] >= lowest && values[i] <= highest) values[i] = std::min(values[i], kAir_hu);
}

double sum_of_limits(const DicomPixels& pixels) {
  if (pixels.table) return std::ldexp(1, pixels.table->bits) - 1;
  const double sum = pixels.is_signed ? -1 : std::ldexp(1, pixels.bits_stored) - 1;  // signed: -2048 to 2047
  return pixels.slope * sum + 2 * pixels.intercept;
}

void scaled_values(const DicomPixels& pixels, const Samples& samples, float* values) {
  using Type = Samples::Type;
  switch (samples.type) {
    case Type::u8:
      return scale<std::uint8_t>(pixels, samples.bytes, values);
    case Type::i8:
      return scale<std::int8_t>(pixels, samples.bytes, values);
    case Type::u16:
      return scale<std::uint16_t>(pixels, samples.bytes, values);
    case Type::i16:
      return scale<std::int16_t>(pixels, samples.bytes, values);
    case Type::u32:
      return scale<std::uint32_t>(pixels, samples.bytes, values);
    default:
      return scale<std::int32_t>(pixels, samples.bytes, values);
  }
}

}  // namespace marrow::files
