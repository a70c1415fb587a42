// SPDX-License-Identifier: Apache-2.0
#include <expat.h>
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"
#include "tiff_pages.hpp"

namespace marrow::files {
namespace {

void check_kind(const std::string& what, const TiffPage& page) {
  static constexpr std::uint16_t kCompressions[] = {1, 5, 8, 32773, 32946};
  if (std::find(std::begin(kCompressions), std::end(kCompressions), page.compression) == std::end(kCompressions))
    throw Error(
        formatted("{}: its pixels are compressed by method {}, which is not read; save it with LZW, Deflate or without "
                  "compression (tiffcp -c lzw does it)",
                  what, page.compression));
  if (page.fill_order != 1 || (page.orientation != 1 && page.orientation != 4))
    throw Error(formatted(
        "{}: its pixels are stored in an unusual order (FillOrder {}, Orientation {}); save it again as a plain TIFF",
        what, page.fill_order, page.orientation));
  if (page.subfile & 5) throw Error(what + ": holds a thumbnail or a mask beside its image; save the image alone");
}

Samples::Type type_of(const std::string& what, const TiffPage& page) {
  using Type = Samples::Type;
  if (page.bits == 8 && page.format == 1) return Type::u8;
  if (page.bits == 8 && page.format == 2) return Type::i8;
  if (page.bits == 16 && page.format == 1) return Type::u16;
  if (page.bits == 16 && page.format == 2) return Type::i16;
  if (page.bits == 32 && page.format == 1) return Type::u32;
  if (page.bits == 32 && page.format == 2) return Type::i32;
  if (page.bits == 32 && page.format == 3) return Type::f32;
  if (page.bits == 64 && page.format == 3) return Type::f64;
  throw Error(
      formatted("{}: its pixels have {} bits in a format that is not read; save it with 8 or 16 bits, or as float",
                what, page.bits));
}

/// An image of some scanners has its bottom row first.
void turn_rows(const TiffPage& page, std::size_t width, std::byte* pixels) {
  const std::size_t row_bytes = page.width * page.samples_together() * width;
  const std::size_t planes = page.samples / page.samples_together();
  for (std::size_t plane = 0; plane < planes; ++plane, pixels += page.height * row_bytes)
    for (std::size_t v = 0; v < page.height / 2; ++v)
      std::swap_ranges(pixels + v * row_bytes, pixels + (v + 1) * row_bytes,
                       pixels + (page.height - 1 - v) * row_bytes);
}

/// Puts the samples of a pixel side by side.
void join_planes(const TiffPage& page, std::size_t width, std::byte* pixels) {
  const std::size_t count = std::size_t(page.width) * page.height, each = std::size_t(page.samples);
  const std::vector<std::byte> planes(pixels, pixels + count * each * width);
  for (std::size_t k = 0; k < each; ++k)
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(pixels + (i * each + k) * width, planes.data() + (k * count + i) * width, width);
}

/// The colours of indices of 8 bits. The palette has 16 bits a value, of which screens show the upper 8.
void look_up_colours(const std::string& what, const TiffPage& page, Samples& samples) {
  if (page.palette[0].empty())
    throw Error(what + ": is damaged: its pixels are colours of a palette, but it has none; copy or export it again");
  std::vector<std::byte> colours(3 * samples.bytes.size());
  for (std::size_t i = 0; i < colours.size(); ++i)
    colours[i] = std::byte(page.palette[i % 3][std::size_t(samples.bytes[i / 3])] >> 8);
  samples.bytes = std::move(colours);
  samples.components = 3;
}

/// Whether its colours, or grey levels with an opacity, are of a kind that is read.
bool has_plain_colours(const TiffPage& page) {
  constexpr std::uint16_t kRgb = 2, kPalette = 3;
  if (page.format != 1 || (page.planes != 1 && page.planes != 2)) return false;
  if (page.photometric == kPalette) return page.samples == 1 && page.bits == 8;
  if (page.bits != 8 && page.bits != 16) return false;
  return page.photometric == kRgb ? page.samples == 3 || page.samples == 4 : page.photometric == 1 && page.samples == 2;
}

template <class T>
void invert_as(std::vector<std::byte>& bytes) {
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(T)) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    value = T(~value);
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }
}

/// Inverts an image whose zero is white, so that higher values are brighter, as in other images.
void invert(const std::string& what, Samples& samples) {
  if (samples.type == Samples::Type::u8) return invert_as<std::uint8_t>(samples.bytes);
  if (samples.type == Samples::Type::u16) return invert_as<std::uint16_t>(samples.bytes);
  throw Error(what +
              ": its zero is white (PhotometricInterpretation WhiteIsZero); that is read for whole numbers of 8 "
              "and 16 bits without sign only: save it with zero as black");
}

/// ImageJ defines its calibration for unsigned integers only, and not for inverted ones.
void check_calibration(const std::string& what, const Samples& samples, const TiffPage& page) {
  if (samples.slope == 1 && samples.intercept == 0) return;
  const bool is_plain = samples.type == Samples::Type::u8 || samples.type == Samples::Type::u16;
  if (!is_plain || page.photometric == 0)
    throw Error(what + ": its values are calibrated by ImageJ (c0, c1), and " +
                (is_plain ? "its zero is white" : "its pixels are not whole numbers of 8 or 16 bits without sign") +
                "; save it uncalibrated (in ImageJ: Analyze, Calibrate), or as float");
}

constexpr const char* kShape = "\"shape\": [";

/// The whole number after `name`, or 1.
long number_behind(const std::string& text, const std::string& name) {
  const std::size_t found = text.find(name);
  return found == std::string::npos ? 1 : std::atol(text.c_str() + found + name.size());
}

/// The text of ImageJ's line "name=text". std::nullopt if there is no such line.
std::optional<std::string> line_behind(const std::string& text, const std::string& name) {
  const std::size_t found = ("\n" + text).find("\n" + name + "=");
  if (found == std::string::npos) return std::nullopt;
  const std::size_t begin = found + name.size() + 1;
  return trimmed(text.substr(begin, text.find_first_of("\r\n", begin) - begin));
}

/// ImageJ stores signed values, such as those of a CT, as unsigned numbers with a calibration: value = c0 + c1 *
/// number.
void read_calibration(const std::string& text, TiffDescription& description) {
  const auto function = line_behind(text, "cf"), c0 = line_behind(text, "c0"), c1 = line_behind(text, "c1");
  if (!function && !c0 && !c1) return;
  if (function != "0") {
    description.calibration = "its values are calibrated by ImageJ's function " + shown(function.value_or("(none)")) +
                              "; that of a straight line (cf=0) is read";
    return;
  }
  const auto intercept = number_of(c0.value_or("")), slope = number_of(c1.value_or(""));
  if (!intercept || !slope || *slope == 0) {
    description.calibration = "its values are calibrated by ImageJ with c0 = '" + shown(c0.value_or("")) +
                              "' and c1 = '" + shown(c1.value_or("")) + "'; two numbers expected, the second not 0";
    return;
  }
  description.intercept = *intercept;
  description.slope = *slope;
}

TiffDescription of_imagej(const std::string& text) {
  TiffDescription description;
  for (const char* name : {"channels", "frames"})
    if (const long count = number_behind("\n" + text, std::string("\n") + name + "="); count > 1) {
      description.other_pages = formatted("an ImageJ stack of {} {}", count, name);
      break;
    }
  if (const auto images = line_behind(text, "images"))
    description.pages = std::uint64_t(std::max(0L, std::atol(images->c_str())));
  read_calibration(text, description);
  return description;
}

/// Whether it is a description of OME, with any namespace prefix.
bool is_ome(const std::string& text) {
  return text.find("<OME") != std::string::npos || text.find("openmicroscopy.org") != std::string::npos;
}

std::string of_tifffile(const std::string& text, std::uint64_t& samples) {
  const std::size_t begin = text.find('[', text.find(kShape)), end = text.find(']', begin);
  if (end == std::string::npos) return {};
  const std::string shape = text.substr(begin, end - begin + 1);
  int dimensions = 0;
  double product = 1;
  for (const char* at = shape.c_str() + 1; *at;) {
    char* stop = nullptr;
    if (const long length = std::strtol(at, &stop, 10); length > 1) ++dimensions, product *= double(length);
    at = stop == at ? at + 1 : stop;
  }
  samples = product < 1e15 ? std::uint64_t(product) : 0;
  if (dimensions > 3) return formatted("an array of {} dimensions, {}", dimensions, shown(shape));
  const std::size_t key = text.find("\"axes\": \"");
  const std::string axes = key == std::string::npos ? "" : text.substr(key + 9, text.find('"', key + 9) - (key + 9));
  if (dimensions == 3 && axes.size() == 3 && (axes[0] == 'T' || axes[0] == 'C'))
    return std::string("a stack of ") + (axes[0] == 'T' ? "times" : "channels");
  return {};
}

constexpr long kNotUnderstood = -1;

/// The number of an attribute, from expat's list of names and values.
long number_of(const char** attributes, std::string_view name, long missing) {
  while (*attributes && *attributes != name) attributes += 2;
  if (!*attributes) return missing;
  const std::string text = attributes[1];
  if (text.empty() || text.size() > 7 || text.find_first_not_of("0123456789") != text.npos) return kNotUnderstood;
  return std::stol(text);
}

/// Whether the slices are in the order of the pages.
bool is_in_order(const char** data) {
  const long first = number_of(data, "FirstZ", 0);
  return first >= 0 && number_of(data, "IFD", 0) == first && number_of(data, "FirstC", 0) == 0 &&
         number_of(data, "FirstT", 0) == 0;
}

/// What the tags tell of the pages.
struct OmePages {
  XML_Parser parser = nullptr;
  int images = 0, pixels = 0;
  bool in_order = true;
  std::string several;
  std::uint64_t pages = 0;
};

void read_tag(void* into, const char* full_name, const char** attributes) {
  OmePages& found = *static_cast<OmePages*>(into);
  std::string_view name = full_name;
  name.remove_prefix(name.find(':') + 1);  // the prefix of its namespace; npos + 1 is 0
  if (name == "Image") ++found.images;
  if (name == "TiffData") found.in_order = found.in_order && is_in_order(attributes);
  if (name != "Pixels" || ++found.pixels > 1) return;
  const long slices = number_of(attributes, "SizeZ", 0), channels = number_of(attributes, "SizeC", kNotUnderstood),
             times = number_of(attributes, "SizeT", kNotUnderstood);
  if (channels < 1 || times < 1 || slices < 0) found.in_order = false;
  if (channels > 1) found.several = formatted("an OME stack of {} channels", channels);
  if (found.several.empty() && times > 1) found.several = formatted("an OME stack of {} times", times);
  if (found.in_order) found.pages = std::uint64_t(slices) * std::uint64_t(channels) * std::uint64_t(times);
}

/// A document type could redefine names, and blow them up.
void refuse_document_type(void* into, const char*, const char*, const char*, int) {
  XML_StopParser(static_cast<OmePages*>(into)->parser, false);
}

/// False if the text is not understood to its end.
bool read_tags(const std::string& text, OmePages& found) {
  // Any byte is a letter of Latin-1: names and numbers are ASCII, and programs write units in encodings of their own.
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate("ISO-8859-1"),
                                                                            XML_ParserFree);
  found.parser = parser.get();
  XML_SetUserData(parser.get(), &found);
  XML_SetStartElementHandler(parser.get(), read_tag);
  XML_SetStartDoctypeDeclHandler(parser.get(), refuse_document_type);
  return XML_Parse(parser.get(), text.data(), int(text.size()), true) == XML_STATUS_OK;
}

}  // namespace

Samples read_tiff(const std::filesystem::path& path) {
  const InputFile file(path);
  const TiffPages tiff = read_tiff_pages(file);
  const TiffPage& first = tiff.pages[0];
  const std::string what = path.string();
  Samples samples;
  samples.dimensions = tiff.pages.size() > 1 ? 3 : 2;
  samples.other_pages = tiff.other_pages;
  samples.slope = tiff.slope;
  samples.intercept = tiff.intercept;
  samples.size = {int(first.width), int(first.height), int(tiff.pages.size())};
  samples.components = first.samples;
  const bool is_grey = first.samples == 1 && first.photometric <= 1;
  if (!is_grey && !has_plain_colours(first)) {
    samples.components = std::max(samples.components, 3);
    return samples;
  }
  for (const TiffPage& page : tiff.pages) check_kind(what, page);
  samples.type = type_of(what, first);
  check_calibration(what, samples, first);
  check_size(what, {samples.size[0], samples.size[1], samples.size[2]}, file.size());
  const std::size_t width = bytes_each(samples.type);
  const std::size_t page_bytes = std::size_t(first.width) * first.height * first.samples * width;
  samples.bytes.resize(page_bytes * tiff.pages.size());
  TiffReader reader(file);
  for (std::byte* to = samples.bytes.data(); const TiffPage& page : tiff.pages) {
    reader.read_strips(page, to);
    if (page.orientation == 4) turn_rows(page, width, to);
    if (page.planes == 2 && page.samples > 1) join_planes(page, width, to);
    to += page_bytes;
    reader.next();
  }
  if (first.photometric == 3) look_up_colours(what, first, samples);
  if (first.photometric == 0) invert(what, samples);
  return samples;
}

TiffDescription read_tiff_description(const std::string& text) {
  TiffDescription description;
  if (text.starts_with("ImageJ=")) description = of_imagej(text);
  if (is_ome(text)) description = read_ome_description(text);
  if (text.starts_with("{") && text.find(kShape) != std::string::npos) {
    description.other_pages = of_tifffile(text, description.samples);
    description.is_truncated = text.find("\"truncated\": true") != std::string::npos;
  }
  return description;
}

// The description of OME-TIFF, an XML text: https://docs.openmicroscopy.org/ome-model. Only one plain stack of slices
// is supported. For anything else, `other_pages` says what the pages are.

TiffDescription read_ome_description(const std::string& text) {
  TiffDescription description;
  OmePages found;
  const bool is_understood = read_tags(text, found);
  if (found.pixels == 1 && found.images <= 1) description.pages = found.pages;
  if (found.images > 1)
    description.other_pages = formatted("an OME file of {} images", found.images);
  else if (!found.several.empty())
    description.other_pages = found.several;
  else if (found.pixels != 1 || !found.in_order || !is_understood)
    description.other_pages =
        "an OME file whose description is not that of one stack of slices in the order of its pages";
  return description;
}

}  // namespace marrow::files
