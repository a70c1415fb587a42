// SPDX-License-Identifier: Apache-2.0
// NRRD (.nrrd, .nhdr): https://teem.sourceforge.net/nrrd/format.html. The NRRD library copies fields into buffers of
// fixed size, and opens any file that a header names. So this file has its own reader.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

/// The items of a field that has one for each axis: words, texts in quotation marks and vectors in parentheses.
std::vector<std::string> items_of(const std::string& text) {
  std::vector<std::string> items;
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t", at)) != std::string::npos;) {
    const char closing = text[at] == '(' ? ')' : text[at] == '"' ? '"' : '\0';
    std::size_t end = closing ? text.find(closing, at + 1) : text.find_first_of(" \t", at);
    end = std::min(end == std::string::npos || !closing ? end : end + 1, text.size());
    items.push_back(text.substr(at, end - at));
    at = end;
  }
  return items;
}

/// Whether the header says that an axis is not one of space.
bool holds_values(const HeaderFields& fields, std::size_t axis, std::size_t axes) {
  const auto directions = items_of(in_small_letters(fields.text_or("space directions", "")));
  if (directions.size() == axes) return directions[axis] == "none";
  const auto kinds = items_of(in_small_letters(fields.text_or("kinds", "")));
  if (kinds.size() != axes) return false;
  const std::string& kind = kinds[axis];
  return kind != "domain" && kind != "space" && kind != "none" && kind != "???";
}

void remove_axis(HeaderFields& fields, std::size_t axis, std::size_t axes) {
  for (const char* key : {"sizes", "spacings", "thicknesses", "axis mins", "axis maxs", "space directions", "centers",
                          "kinds", "labels", "units"}) {
    std::vector<std::string> items = items_of(fields.text_or(key, ""));
    if (items.size() != axes) continue;  // the reader refuses it
    items.erase(items.begin() + std::ptrdiff_t(axis));
    std::string text;
    for (const std::string& item : items) text += (text.empty() ? "" : " ") + item;
    fields.replace(key, text);
  }
  fields.replace("dimension", formatted("{}", axes - 1));
}

/// The fields of a NRRD header without the axes that hold one sample and do not belong to the volume: one value per
/// voxel, one label map, one point in time. Their order in the file does not matter, because each has one sample. More
/// than three other axes, or fields that contradict each other, are left for the reader to refuse.
HeaderFields without_single_samples(HeaderFields fields) {
  std::size_t axes = items_of(fields.text_or("sizes", "")).size();
  if (fields.text_or("dimension", "") != formatted("{}", axes)) return fields;
  const auto remove_if = [&](std::size_t least, auto is_wanted) {
    for (std::size_t axis = axes; axis-- > 0 && axes > least;)
      if (items_of(fields.text("sizes"))[axis] == "1" && is_wanted(axis)) remove_axis(fields, axis, axes--);
  };
  remove_if(1, [&](std::size_t axis) { return holds_values(fields, axis, axes); });
  remove_if(3, [&](std::size_t axis) { return axis >= 3 && !fields.has("space directions"); });
  return fields;
}

/// The axis of a header of four axes that is not one of space: the layers of a segmentation. Several samples lie along
/// it. std::nullopt if there is none.
std::optional<std::size_t> axis_of_layers(const HeaderFields& fields) {
  constexpr std::size_t kAxes = 4;
  if (fields.text_or("dimension", "") != "4" || items_of(fields.text_or("sizes", "")).size() != kAxes) return {};
  for (std::size_t axis = 0; axis < kAxes; ++axis)
    if (holds_values(fields, axis, kAxes)) return axis;
  return {};
}

/// The fields without what they say of this axis.
HeaderFields without_axis(HeaderFields fields, std::size_t axis) {
  remove_axis(fields, axis, items_of(fields.text_or("sizes", "")).size());
  return fields;
}

constexpr long long kMostLayers = 100;

/// Whether the format defines a field of this name.
bool is_field(const std::string& name) {
  constexpr std::string_view kFields =
      "|content|number|type|block size|dimension|space|space dimension|sizes|spacings|thicknesses|axis mins|axis maxs|"
      "space directions|centers|kinds|labels|units|min|max|old min|old max|endian|encoding|line skip|byte skip|"
      "sample units|space units|space origin|measurement frame|data file|";
  return name.find('|') == std::string::npos && kFields.find("|" + name + "|") != std::string_view::npos;
}

struct NrrdHeader {
  HeaderFields fields;
  std::uint64_t end = 0;  ///< offset of samples in the same file
  std::map<std::string, std::string> notes{};
};

NrrdHeader read_nrrd_header(const InputFile& file) {
  static const std::map<std::string, std::string> kSame{
      {"blocksize", "block size"},     {"axismins", "axis mins"}, {"axismaxs", "axis maxs"}, {"centerings", "centers"},
      {"oldmin", "old min"},           {"oldmax", "old max"},     {"lineskip", "line skip"}, {"byteskip", "byte skip"},
      {"sampleunits", "sample units"}, {"datafile", "data file"}};
  NrrdHeader header{HeaderFields(file.path())};
  HeaderLines lines(file);
  const std::string what = file.path().string();
  const auto first = lines.next();
  if (!first || first->size() != 8 || first->rfind("NRRD000", 0) != 0 ||
      !std::isdigit(static_cast<unsigned char>((*first)[7])))
    throw Error(what + ": is not a NRRD file, or is damaged at its start");
  for (int number = 2;; ++number) {
    const auto line = lines.next();
    if (line && !line->empty() && (*line)[0] == '#') continue;
    header.end = lines.at();
    if (!line || line->empty()) return header;  // if the file ends here, the samples are in another file
    const std::size_t colon = line->find(':');
    if (colon != std::string::npos && line->compare(colon, 2, ":=") == 0) {
      header.notes[line->substr(0, colon)] = line->substr(colon + 2);
      continue;
    }
    std::string key = in_small_letters(trimmed(line->substr(0, colon)));
    if (const auto same = kSame.find(key); same != kSame.end()) key = same->second;
    if (colon == std::string::npos || line->find('\0') != std::string::npos || !is_field(key))
      throw Error(
          formatted("{}:{}: expected a field of a NRRD header, got '{}'; it is damaged: copy or export it again", what,
                    number, shown(*line)));
    header.fields.add(key, line->substr(colon + 1));
    if (key == "data file" && in_small_letters(header.fields.text(key).substr(0, 4)) == "list")
      return header;  // the following lines are file names
  }
}

Samples::Type nrrd_type(const HeaderFields& fields) {
  using Type = Samples::Type;
  static const std::pair<Type, std::vector<std::string>> kNames[] = {
      {Type::i8, {"signed char", "int8", "int8_t"}},
      {Type::u8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {Type::i16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {Type::u16, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
      {Type::i32, {"int", "signed int", "int32", "int32_t"}},
      {Type::u32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {Type::i64,
       {"longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"}},
      {Type::u64, {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"}},
      {Type::f32, {"float"}},
      {Type::f64, {"double"}}};
  const std::string name = in_small_letters(fields.text("type"));
  for (const auto& [type, names] : kNames)
    if (std::find(names.begin(), names.end(), name) != names.end()) return type;
  fields.refuse("type", "a kind of number, as short or float");
}

/// `count` vectors "(a,b,c)".
std::vector<std::array<double, 3>> vectors(const HeaderFields& fields, const std::string& key, std::size_t count) {
  std::string text = fields.text(key);
  std::vector<std::array<double, 3>> vectors;
  while (!(text = trimmed(text)).empty()) {
    const std::size_t end = text.find(')');
    if (text[0] != '(' || end == std::string::npos || vectors.size() == count) break;
    std::array<double, 3> vector{};
    std::size_t at = 1;
    for (int k = 0; k < 3; ++k) {
      const std::size_t stop = k < 2 ? text.find(',', at) : end;
      const auto number = stop > end || stop < at ? std::nullopt : number_of(trimmed(text.substr(at, stop - at)));
      if (!number) fields.refuse(key, formatted("{} times three numbers, as (1,0,0)", count));
      vector[std::size_t(k)] = *number;
      at = stop + 1;
    }
    vectors.push_back(vector);
    text.erase(0, end + 1);
  }
  if (!text.empty() || vectors.size() != count)
    fields.refuse(key, formatted("{} times three numbers, as (1,0,0)", count));
  return vectors;
}

/// Signs that turn the axes of the file's space into patient axes LPS.
std::array<double, 3> signs_of(const HeaderFields& fields) {
  const std::string space = in_small_letters(fields.text_or("space", "left-posterior-superior"));
  if (fields.whole_number_or("space dimension", 3) != 3) fields.refuse("space dimension", "3");
  if (space == "left-posterior-superior" || space == "lps") return {1, 1, 1};
  if (space == "right-anterior-superior" || space == "ras") return {-1, -1, 1};
  if (space == "left-anterior-superior" || space == "las") return {1, -1, 1};
  fields.refuse("space", "left-posterior-superior, right-anterior-superior or left-anterior-superior");
}

void check_units(const HeaderFields& fields, const std::string& key) {
  std::string text = in_small_letters(fields.text_or(key, ""));
  for (char& c : text)
    if (c == '"') c = ' ';
  for (const std::string& unit : words_of(text))
    if (unit != "mm" && unit != "millimeter" && unit != "millimeters" && unit != "???" && unit != "none")
      fields.refuse(key, "mm");
}

/// For each axis, whether its ends are the centres of the first and last voxel (node) and not their borders (cell, or
/// not given).
std::array<bool, 3> nodes_of(const HeaderFields& fields) {
  std::array<bool, 3> are_nodes{};
  if (!fields.has("centers")) return are_nodes;
  const std::vector<std::string> words = words_of(in_small_letters(fields.text("centers")));
  if (words.size() != 3) fields.refuse("centers", "one of cell, node and none for each of the axes");
  for (std::size_t k = 0; k < 3; ++k) {
    if (words[k] != "node" && words[k] != "cell" && words[k] != "none" && words[k] != "???")
      fields.refuse("centers", "one of cell, node and none for each of the axes");
    are_nodes[k] = words[k] == "node";
  }
  return are_nodes;
}

/// Reads the grid from the fields of single axes. The axes are then those of the patient.
void read_grid_without_space(const HeaderFields& fields, Samples& samples) {
  for (const char* key : {"space", "space dimension", "space origin"})
    if (fields.has(key))
      throw Error(fields.path().string() + ": its header has '" + key +
                  "' but no 'space directions', which say how its axes lie there; add 'space directions: (X,0,0) "
                  "(0,Y,0) (0,0,Z)' "
                  "with the voxels' sizes (or as its axes lie), and take 'spacings' out");
  const bool has_ends = fields.has("axis mins") || fields.has("axis maxs");
  if (!fields.has("spacings")) {
    if (has_ends)
      throw Error(fields.path().string() +
                  ": its header gives the ends of its axes but no 'spacings'; add 'spacings: X Y Z' (mm)");
    samples.spacing_field = "spacings: X Y Z";
    return;
  }
  const auto spacings = fields.numbers("spacings", 3);
  std::copy(spacings.begin(), spacings.end(), samples.spacing_mm.begin());
  if (!has_ends) return;
  const auto least = fields.numbers("axis mins", 3);
  const auto are_nodes = nodes_of(fields);
  for (std::size_t k = 0; k < 3; ++k) samples.origin_mm[k] = least[k] + (are_nodes[k] ? 0 : spacings[k] / 2);
  if (!fields.has("axis maxs")) return;
  const auto greatest = fields.numbers("axis maxs", 3);
  for (std::size_t k = 0; k < 3; ++k)
    if (const double length = spacings[k] * (samples.size[k] - (are_nodes[k] ? 1 : 0));
        std::abs(greatest[k] - least[k] - length) > 1e-3 * std::abs(length))
      fields.refuse("axis maxs",
                    formatted("'axis mins' and as many 'spacings' as there are voxels ({:f})", least[k] + length));
}

/// The format does not allow 'spacings' together with 'space directions'. They are accepted if they agree or are NaN.
void check_spacings(const HeaderFields& fields, const std::array<double, 3>& lengths_mm) {
  const std::vector<std::string> spacings = words_of(fields.text_or("spacings", ""));
  for (std::size_t k = 0; k < spacings.size(); ++k) {
    if (in_small_letters(spacings[k]) == "nan") continue;
    const auto spacing = number_of(spacings[k]);
    if (k >= 3 || !spacing || std::abs(*spacing - lengths_mm[k]) > 1e-3 * lengths_mm[k])
      fields.refuse("spacings", "the lengths of the 'space directions' (or take 'spacings' out)");
  }
}

void read_grid(const HeaderFields& fields, Samples& samples) {
  check_units(fields, "units");
  check_units(fields, "space units");
  const auto signs = signs_of(fields);
  if (fields.has("space directions")) {
    const auto axes = vectors(fields, "space directions", 3);
    for (std::size_t k = 0; k < 3; ++k) {
      const double length = std::sqrt(axes[k][0] * axes[k][0] + axes[k][1] * axes[k][1] + axes[k][2] * axes[k][2]);
      if (!(length > 0) || !std::isfinite(length)) fields.refuse("space directions", "axes with a length");
      samples.spacing_mm[k] = length;
      for (std::size_t row = 0; row < 3; ++row)
        samples.direction[row * 3 + k] = signs[row] * (axes[k][row] * (1.0 / length));
    }
    check_spacings(fields, samples.spacing_mm);
    if (fields.has("space origin")) {
      const auto origin = vectors(fields, "space origin", 1)[0];
      for (std::size_t row = 0; row < 3; ++row) samples.origin_mm[row] = signs[row] * origin[row];
    }
    return;
  }
  read_grid_without_space(fields, samples);
}

std::array<long long, 3> size_of(const HeaderFields& fields, long long dimensions) {
  const std::vector<std::string> kinds = words_of(in_small_letters(fields.text_or("kinds", "")));
  if (!kinds.empty() && kinds.size() != std::size_t(dimensions)) fields.refuse("kinds", "one for each of the axes");
  std::array<long long, 3> size{1, 1, 1};
  const auto sizes = fields.numbers("sizes", std::size_t(dimensions));
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    if (!(sizes[k] >= 1 && sizes[k] < 1e15) || sizes[k] != std::floor(sizes[k]))
      fields.refuse("sizes", "whole numbers above 0");
    const std::string kind = kinds.empty() ? "domain" : kinds[k];
    if (kind != "domain" && kind != "space" && kind != "none" && kind != "???" && kind != "stub" && kind != "scalar")
      throw Error(formatted("{}: has {} values per voxel; a CT has one", fields.path().string(), (long long)sizes[k]));
    if (k < 3) size[k] = (long long)sizes[k];
  }
  if (dimensions > 3)
    throw Error(formatted("{}: has {} dimensions; expected one volume", fields.path().string(), dimensions));
  return size;
}

StoredSamples stored_in(const HeaderFields& fields, const InputFile& data, std::uint64_t header_end,
                        std::size_t count) {
  StoredSamples stored;
  stored.type = nrrd_type(fields);
  stored.count = count;
  const std::string encoding = in_small_letters(fields.text("encoding"));
  stored.is_packed = encoding == "gzip" || encoding == "gz";
  if (!stored.is_packed && encoding != "raw") fields.refuse("encoding", "raw or gzip: save it as one of them");
  if (bytes_each(stored.type) > 1) {
    const std::string order = in_small_letters(fields.text("endian"));
    if (order != "little" && order != "big") fields.refuse("endian", "little or big");
    stored.big_endian = order == "big";
  }
  if (fields.whole_number_or("line skip", 0) != 0) fields.refuse("line skip", "0");
  const long long skip = fields.whole_number_or("byte skip", 0);
  if (skip < -1 || (skip > 0 && std::uint64_t(skip) > data.size()) || (stored.is_packed && skip != 0))
    fields.refuse("byte skip", "a place in the file");
  const std::uint64_t sample_bytes = count * bytes_each(stored.type);
  stored.begin = skip == -1 ? data.size() - std::min(data.size(), sample_bytes) : header_end + std::uint64_t(skip);
  return stored;
}

/// The samples of one volume, or of several `layers` with the same grid, as they follow each other in the file.
VolumeSamples read_samples(const InputFile& file, const NrrdHeader& header, const HeaderFields& fields,
                           std::size_t layers, bool folder_is_named) {
  const std::filesystem::path& path = file.path();
  const long long dimensions = fields.whole_number_or("dimension", 0);
  if (dimensions < 1 || dimensions > 16) fields.refuse("dimension", "3");
  const bool is_detached = fields.has("data file");
  const InputFile data(is_detached ? file_beside(path, fields.text("data file"), folder_is_named) : path);
  const auto size = size_of(fields, dimensions);
  check_size(path.string(), size, data.size());
  VolumeSamples volume;
  volume.geometry.dimensions = int(dimensions);
  for (std::size_t k = 0; k < 3; ++k) volume.geometry.size[k] = int(size[k]);
  if (dimensions == 3) read_grid(fields, volume.geometry);
  const StoredSamples stored = stored_in(fields, data, is_detached ? 0 : header.end, layers * volume.geometry.count());
  volume.geometry.type = stored.type_of_values();
  volume.values = read_floats(data, stored);
  return volume;
}

}  // namespace

VolumeSamples read_nrrd(const std::filesystem::path& path, bool folder_is_named) {
  const InputFile file(path);
  const NrrdHeader header = read_nrrd_header(file);
  return read_samples(file, header, without_single_samples(header.fields), 1, folder_is_named);
}

NrrdLayers read_nrrd_layers(const std::filesystem::path& path, bool folder_is_named) {
  const InputFile file(path);
  const NrrdHeader header = read_nrrd_header(file);
  HeaderFields fields = without_single_samples(header.fields);
  NrrdLayers layers{{}, {}, header.notes};
  const auto axis = axis_of_layers(fields);
  if (!axis) {
    layers.samples = read_samples(file, header, fields, 1, folder_is_named);
    layers.values.push_back(std::move(layers.samples.values));
    return layers;
  }
  const auto count = (long long)fields.numbers("sizes", 4)[*axis];
  if ((*axis != 0 && *axis != 3) || count < 1 || count > kMostLayers)
    fields.refuse("sizes", formatted("1 to {} layers of a segmentation, as the first or the last axis", kMostLayers));
  layers.samples = read_samples(file, header, without_axis(fields, *axis), std::size_t(count), folder_is_named);
  const std::vector<float> all = std::move(layers.samples.values);
  const std::size_t voxels = layers.samples.geometry.count(), step = *axis == 0 ? std::size_t(count) : 1;
  for (std::size_t layer = 0; layer < std::size_t(count); ++layer) {
    layers.values.emplace_back(voxels);
    const float* first = all.data() + (*axis == 0 ? layer : layer * voxels);
    for (std::size_t i = 0; i < voxels; ++i) layers.values.back()[i] = first[i * step];
  }
  return layers;
}

}  // namespace marrow::files
