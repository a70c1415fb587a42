// SPDX-License-Identifier: Apache-2.0
// MetaImage (.mha, .mhd): https://itk.org/Wiki/MetaIO/Documentation. MetaIO itself returns uninitialised memory for
// missing samples, and opens any file that a header names. So this file has its own reader.
#include <algorithm>
#include <cmath>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

struct MetaHeader {
  HeaderFields fields;
  std::uint64_t end = 0;  ///< offset of samples in the same file
};

MetaHeader read_meta_header(const InputFile& file) {
  MetaHeader header{HeaderFields(file.path())};
  HeaderLines lines(file);
  while (const auto line = lines.next()) {
    const std::string text = trimmed(*line);
    if (text.empty() || text[0] == '#' || text[0] == '%') continue;
    const std::size_t at = line->find_first_of("=:");
    if (at == std::string::npos || line->find('\0') != std::string::npos)
      throw Error(file.path().string() + ": is not a MetaImage file, or is damaged at its start");
    header.fields.add(line->substr(0, at), line->substr(at + 1));
    header.end = lines.at();
    if (header.fields.has("elementdatafile")) return header;  // it is the last one
  }
  throw Error(file.path().string() + ": its header has no 'ElementDataFile'; it is no MetaImage, or is cut off");
}

Samples::Type meta_type(const HeaderFields& fields) {
  using Type = Samples::Type;
  static const std::map<std::string, Type> kTypes{
      {"met_char", Type::i8},       {"met_uchar", Type::u8},       {"met_short", Type::i16}, {"met_ushort", Type::u16},
      {"met_int", Type::i32},       {"met_uint", Type::u32},       {"met_long", Type::i32},  {"met_ulong", Type::u32},
      {"met_long_long", Type::i64}, {"met_ulong_long", Type::u64}, {"met_float", Type::f32}, {"met_double", Type::f64}};
  const auto found = kTypes.find(in_small_letters(fields.text("elementtype")));
  if (found == kTypes.end()) fields.refuse("elementtype", "a kind of number, as MET_SHORT or MET_FLOAT");
  return found->second;
}

/// Which of several names for the same field the header uses; empty if none. Throws Error if it uses two.
std::string one_of(const HeaderFields& fields, const std::vector<std::string>& names) {
  std::string there;
  for (const std::string& name : names) {
    if (!fields.has(name)) continue;
    if (!there.empty()) fields.refuse(name, "it only once, but '" + there + "' says the same");
    there = name;
  }
  return there;
}

void read_grid(const HeaderFields& fields, std::size_t dimensions, Samples& samples) {
  // As in MetaIO, the element size is the spacing if there is no spacing. If there is neither, MetaIO takes 1; here the
  // user must give the spacing.
  if (const std::string key = fields.has("elementspacing") ? "elementspacing" : "elementsize"; fields.has(key)) {
    const auto spacing = fields.numbers(key, dimensions);
    std::copy_n(spacing.begin(), std::min<std::size_t>(3, dimensions), samples.spacing_mm.begin());
  } else {
    samples.spacing_field = "ElementSpacing = X Y Z";
  }
  if (const std::string key = one_of(fields, {"offset", "position", "origin"}); !key.empty()) {
    const auto origin = fields.numbers(key, dimensions);
    std::copy_n(origin.begin(), std::min<std::size_t>(3, dimensions), samples.origin_mm.begin());
  }
  if (const std::string key = one_of(fields, {"transformmatrix", "rotation", "orientation"}); !key.empty()) {
    const auto axes = fields.numbers(key, dimensions * dimensions);  // axis by axis
    for (std::size_t axis = 0; axis < dimensions; ++axis)
      for (std::size_t row = 0; row < dimensions; ++row) {
        const double value = axes[axis * dimensions + row];
        if (axis < 3 && row < 3)
          samples.direction[row * 3 + axis] = value;
        else if (axis != row && value != 0)
          fields.refuse(key, "zeros between the axes of the volume and others");
      }
  }
}

void check_fields(const HeaderFields& fields) {
  if (fields.has("objecttype") && in_small_letters(fields.text("objecttype")) != "image")
    fields.refuse("objecttype", "Image");
  if (const std::string unit = in_small_letters(fields.text_or("distanceunits", "mm")); unit != "mm" && unit != "?")
    fields.refuse("distanceunits", "mm: save it with its lengths in mm");
  if (const long long count = fields.whole_number_or("elementnumberofchannels", 1); count != 1)
    throw Error(formatted("{}: has {} values per voxel; a CT has one", fields.path().string(), count));
  if (!fields.is_true_or("binarydata", false) && !fields.is_true_or("compresseddata", false))
    throw Error(fields.path().string() +
                ": its samples are written as text, which is not read; save it with BinaryData = True");
  for (const auto& [key, value] :
       {std::pair{"elementtointensityfunctionslope", 1.0}, std::pair{"elementtointensityfunctionoffset", 0.0}})
    if (fields.has(key) && fields.numbers(key, 1)[0] != value)
      fields.refuse(
          key, formatted("{}: samples that are to be scaled are not read; save the values themselves", int(value)));
}

/// Offset of the samples in the file that holds them.
std::uint64_t begin_of(const HeaderFields& fields, const InputFile& data, std::uint64_t header_end,
                       std::uint64_t sample_bytes) {
  const long long skipped = fields.whole_number_or("headersize", 0);
  if (skipped < -1 || (skipped > 0 && std::uint64_t(skipped) > data.size()))
    fields.refuse("headersize", "a place in the file, or -1");
  if (skipped > 0) return std::uint64_t(skipped);
  if (skipped == 0) return header_end;
  if (fields.is_true_or("compresseddata", false)) fields.refuse("headersize", "no -1 with compressed samples");
  return data.size() - std::min(data.size(), sample_bytes);  // the samples are at the end of the file
}

VolumeSamples read_samples(const MetaHeader& header, const InputFile& data, std::uint64_t header_end) {
  const HeaderFields& fields = header.fields;
  const long long dimensions = fields.whole_number_or("ndims", 3);
  if (dimensions < 1 || dimensions > 10) fields.refuse("ndims", "3");
  std::array<long long, 3> size{1, 1, 1};
  const auto sizes = fields.numbers("dimsize", std::size_t(dimensions));
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    if (sizes[k] != std::floor(sizes[k]) || !(std::abs(sizes[k]) < 1e15)) fields.refuse("dimsize", "whole numbers");
    if (k < 3)
      size[k] = (long long)sizes[k];
    else if (sizes[k] != 1)
      throw Error(formatted("{}: has {} dimensions; expected one volume", fields.path().string(), dimensions));
  }
  check_fields(fields);
  StoredSamples stored;
  stored.type = meta_type(fields);
  check_size(fields.path().string(), size, data.size());
  VolumeSamples volume;
  volume.geometry.dimensions = int(std::min(3ll, dimensions));
  for (int k = 0; k < 3; ++k) volume.geometry.size[std::size_t(k)] = int(size[std::size_t(k)]);
  read_grid(fields, std::size_t(dimensions), volume.geometry);
  stored.count = volume.geometry.count();
  stored.is_packed = fields.is_true_or("compresseddata", false);
  stored.big_endian = fields.is_true_or(one_of(fields, {"binarydatabyteordermsb", "elementbyteordermsb"}), false);
  stored.begin = begin_of(fields, data, header_end, stored.count * bytes_each(stored.type));
  if (const long long packed = fields.whole_number_or("compresseddatasize", 0);
      packed < 0 || std::uint64_t(packed) > data.size() - std::min(stored.begin, data.size()))
    fields.refuse("compresseddatasize", "no more bytes than the file holds");
  volume.geometry.type = stored.type_of_values();
  volume.values = read_floats(data, stored);
  return volume;
}

}  // namespace

VolumeSamples read_meta_image(const std::filesystem::path& path, bool folder_is_named) {
  const InputFile file(path);
  const MetaHeader header = read_meta_header(file);
  const std::string name = header.fields.text("elementdatafile");
  if (in_small_letters(name) == "local") return read_samples(header, file, header.end);
  const InputFile data(file_beside(path, name, folder_is_named));
  return read_samples(header, data, 0);
}

}  // namespace marrow::files
