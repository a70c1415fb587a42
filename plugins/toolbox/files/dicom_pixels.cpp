// SPDX-License-Identifier: Apache-2.0
#include "dicom_pixels.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace marrow::files
