// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/label_file.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "header_lines.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "nifti.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

/// A header with more extensions than this has other things in them than names.
constexpr double kMostExtensionBytes = 4 << 20;
constexpr double kMostNumber = 65535;

/// The bytes between the NIfTI header and the samples.
std::string extensions_of(const InputFile& file) {
  const NiftiHeader header = read_nifti_header(file);
  if (!(header.begin > header.least_begin) || !(header.begin <= kMostExtensionBytes)) return {};
  std::string bytes(std::size_t(header.begin), '\0');
  bytes.resize(bytes_of_gzip_or_plain(file)->take(bytes.data(), bytes.size()));
  return bytes.size() > std::size_t(header.least_begin) ? bytes.substr(std::size_t(header.least_begin)) : "";
}

std::optional<int> label_in(const std::string& text) {
  const auto number = number_of(trimmed(text));
  if (!number || *number < 0 || *number > kMostNumber || *number != double(int(*number))) return std::nullopt;
  return int(*number);
}

std::string between(const std::string& text, const std::string& before, const std::string& after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string::npos) return {};
  const std::size_t end = text.find(after, begin + before.size());
  return end == std::string::npos ? "" : text.substr(begin + before.size(), end - begin - before.size());
}

struct BonesOfTask {
  const char* task;
  int first;  ///< the number of the first name; the others follow
  std::vector<std::string> names;
};

std::vector<std::string> counted_names(const std::string& before, int from, int to) {
  std::vector<std::string> names;
  for (int i = from; i != to + (to > from ? 1 : -1); i += to > from ? 1 : -1)
    names.push_back(formatted("{}{}", before, i));
  return names;
}

/// The bones of TotalSegmentator 2 (Wasserthal et al., Radiology: Artificial Intelligence 2023), from the tables of its
/// tasks `total` and `appendicular_bones`.
const std::vector<BonesOfTask>& known_bones() {
  static const std::vector<BonesOfTask> kBones{
      {"total", 25, {"sacrum", "vertebrae_S1"}},
      {"total", 27, counted_names("vertebrae_L", 5, 1)},
      {"total", 32, counted_names("vertebrae_T", 12, 1)},
      {"total", 44, counted_names("vertebrae_C", 7, 1)},
      {"total",
       69,
       {"humerus_left", "humerus_right", "scapula_left", "scapula_right", "clavicula_left", "clavicula_right",
        "femur_left", "femur_right", "hip_left", "hip_right"}},
      {"total", 91, {"skull"}},
      {"total", 92, counted_names("rib_left_", 1, 12)},
      {"total", 104, counted_names("rib_right_", 1, 12)},
      {"total", 116, {"sternum", "costal_cartilages"}},
      {"appendicular_bones",
       1,
       {"patella", "tibia", "fibula", "tarsal", "metatarsal", "phalanges_feet", "ulna", "radius", "carpal",
        "metacarpal", "phalanges_hand"}}};
  return kBones;
}

/// How TotalSegmentator 2 numbers a bone.
struct KnownLabel {
  int number = 0;
  std::string task;  ///< of TotalSegmentator
};

/// The names that TotalSegmentator writes to a NIfTI file: an extension in XML with <Label Key="75">femur_left</Label>.
/// Empty if there are none.
std::map<int, std::string> names_in_nifti(const std::filesystem::path& path) {
  std::map<int, std::string> names;
  const std::string text = extensions_of(InputFile(path));
  for (std::size_t at = 0; (at = text.find("<Label ", at)) != std::string::npos;) {
    const std::size_t end = text.find("</Label>", at);
    if (end == std::string::npos) break;
    const std::string label = text.substr(at, end - at);
    const auto number = label_in(between(label, "Key=\"", "\""));
    std::string name = between(label, "<![CDATA[", "]]>");
    if (name.empty()) name = label.substr(std::min(label.size(), label.find('>') + 1));
    if (number && *number > 0 && !trimmed(name).empty()) names[*number] = trimmed(name);
    at = end;
  }
  return names;
}

/// The segments that the notes of a .seg.nrrd name: Segment0_Name, Segment0_LabelValue, Segment0_Layer and so on. Empty
/// if there are none. `layers`: how many the file has. Throws Error if a note names another layer.
std::vector<Segment> segments_in_notes(const std::filesystem::path& path,
                                       const std::map<std::string, std::string>& notes, std::size_t layers) {
  std::vector<Segment> segments;
  for (std::size_t i = 0; i < 1000; ++i) {
    const auto note = [&](const char* what, const std::string& missing) {
      const auto found = notes.find(formatted("Segment{}_{}", i, what));
      return found == notes.end() ? missing : trimmed(found->second);
    };
    const std::string id = note("ID", ""), name = note("Name", id);
    if (name.empty()) break;
    // Before 3D Slicer 4.11 each segment was a layer of its own, with the label 1.
    const auto layer = label_in(note("Layer", formatted("{}", i))), number = label_in(note("LabelValue", "1"));
    if (!layer || std::size_t(*layer) >= layers || !number || *number < 1)
      throw Error(
          formatted("{}: its header puts the segment '{}' to the layer {} with the label {}, but there are {} "
                    "layers; it is damaged: save it again",
                    path.string(), shown(name), shown(note("Layer", formatted("{}", i))),
                    shown(note("LabelValue", "1")), layers));
    segments.push_back({*number, name, std::size_t(*layer)});
  }
  return segments;
}

std::optional<KnownLabel> label_of_totalsegmentator(const std::string& name) {
  for (const BonesOfTask& part : known_bones())
    if (const auto at = std::find(part.names.begin(), part.names.end(), name); at != part.names.end())
      return KnownLabel{part.first + int(at - part.names.begin()), part.task};
  return std::nullopt;
}

/// All names that label_of_totalsegmentator() knows.
std::vector<std::string> names_of_totalsegmentator() {
  std::vector<std::string> names;
  for (const BonesOfTask& part : known_bones()) names.insert(names.end(), part.names.begin(), part.names.end());
  return names;
}

namespace fs = std::filesystem;

constexpr int kMostLabel = 65535;
constexpr int kMaskBorder = 3;  // voxels around a mask

LabelMap of_one_volume(Volume volume) {
  LabelMap map;
  map.grid = volume.grid;
  map.layers.push_back(std::move(volume.values));
  return map;
}

/// Layers are turned right-handed one by one.
LabelMap read_nrrd_labels(const fs::path& path) {
  NrrdLayers read = read_nrrd_layers(path, false);
  if (read.samples.geometry.dimensions < 3 || !read.samples.geometry.spacing_field.empty())
    return of_one_volume(read_volume_file(path, {}));  // which says what is missing
  LabelMap map;
  for (std::vector<float>& values : read.values) {
    Volume volume{grid_of(read.samples.geometry), std::move(values)};
    make_right_handed(volume);
    check_volume(volume, path.string());
    map.grid = volume.grid;
    map.layers.push_back(std::move(volume.values));
  }
  map.segments = segments_in_notes(path, read.notes, map.layers.size());
  return map;
}

/// The labels of a layer that have a voxel.
std::set<int> labels_in(const fs::path& path, const std::vector<float>& layer) {
  std::vector<bool> found(kMostLabel + 1, false);
  for (const float value : layer) {
    if (!(value >= 0 && value <= float(kMostLabel)) || value != std::floor(value))
      throw Error(
          formatted("{}: is no label map: a voxel has the value {:.6g}; expected whole numbers from 0 to {}. Is "
                    "it the CT, or a map of probabilities?",
                    path.string(), value, kMostLabel));
    found[std::size_t(value)] = true;
  }
  std::set<int> labels;
  for (int label = 1; label <= kMostLabel; ++label)
    if (found[std::size_t(label)]) labels.insert(label);
  return labels;
}

/// Adds what has voxels, but that the header does not list, and names it.
void complete(LabelMap& map, const std::map<int, std::string>& names) {
  bool is_empty = true;
  for (std::size_t layer = 0; layer < map.layers.size(); ++layer)
    for (const int label : labels_in(map.path, map.layers[layer])) {
      is_empty = false;
      const bool is_listed = std::any_of(map.segments.begin(), map.segments.end(), [&](const Segment& segment) {
        return segment.layer == layer && segment.number == label;
      });
      const auto name = names.find(label);
      if (!is_listed) map.segments.push_back({label, name == names.end() ? "" : name->second, layer});
    }
  if (is_empty) throw Error(map.path.string() + ": all its voxels are 0, so it marks nothing");
}

std::string segments_text(const LabelMap& map) {
  constexpr std::size_t kShown = 30;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, map.segments.size()); ++i)
    text += formatted("{}{}{}", i ? ", " : "", map.segments[i].number,
                      map.segments[i].name.empty() ? "" : " '" + map.segments[i].name + "'");
  if (map.segments.size() > kShown) text += formatted(" and {} more", map.segments.size() - kShown);
  return text;
}

std::string nearest_among(const std::string& wrong, const std::vector<std::string>& known) {
  const std::string nearest = nearest_name(wrong, known);
  return nearest.empty() ? "" : "did you mean '" + nearest + "'? ";
}

bool is_label_number(const std::string& text) {
  return !text.empty() && text.size() < 10 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::vector<const Segment*> segments_with(const LabelMap& map, int number) {
  std::vector<const Segment*> found;
  for (const Segment& segment : map.segments)
    if (segment.number == number) found.push_back(&segment);
  return found;
}

/// The segment of a file without names, by the table of TotalSegmentator.
const Segment& by_table(const LabelMap& map, const std::string& name,
                        const std::function<void(const std::string&)>& warn) {
  const auto known = label_of_totalsegmentator(name);
  const std::string what = map.path.string() + ": does not name its labels, and ";
  if (!known)
    throw Error(what + "'" + name + "' is no bone of TotalSegmentator's tables; " +
                nearest_among(name, names_of_totalsegmentator()) + "give its number; the file has the labels " +
                segments_text(map));
  const auto found = segments_with(map, known->number);
  const std::string taken =
      formatted("'{}' is {} where TotalSegmentator's task {} made it", name, known->number, known->task);
  if (found.empty()) throw Error(what + taken + ", which it lacks; it has the labels " + segments_text(map));
  if (warn) warn(what + taken + "; this label is taken: give its number where another program made the file");
  return *found[0];
}

}  // namespace

LabelMap read_label_file(const fs::path& path) {
  std::error_code failure;
  if (!fs::exists(path, failure)) throw Error(path.string() + ": there is no such file or folder");
  LabelMap map;
  std::map<int, std::string> names;
  const fs::path segmentation = dicom_segmentation_in(path);
  const FileFormat format = fs::is_directory(path, failure) ? FileFormat::unknown : file_format(path);
  if (!segmentation.empty()) {
    map = read_dicom_segmentation(segmentation);
  } else if (format == FileFormat::nrrd) {
    map = read_nrrd_labels(path);
  } else if (format == FileFormat::tiff) {
    throw Error(path.string() +
                ": a TIFF does not say where its voxels lie; save the labels as .nii.gz, .nrrd or .mha");
  } else {
    map = of_one_volume(read_volume_file(path, {}));
    if (format == FileFormat::nifti) names = names_in_nifti(path);
  }
  map.path = path;
  complete(map, names);
  return map;
}

const Segment& segment_named(const LabelMap& map, const std::string& label,
                             const std::function<void(const std::string&)>& warn) {
  std::vector<const Segment*> found;
  std::vector<std::string> names;
  for (const Segment& segment : map.segments) {
    if (segment.name.empty()) continue;
    names.push_back(segment.name);
    if (segment.name == label) found.push_back(&segment);
  }
  if (found.empty() && is_label_number(label)) {
    found = segments_with(map, std::stoi(label));
    if (found.empty()) throw Error(map.path.string() + ": has no label " + label + "; it has " + segments_text(map));
  }
  if (found.empty() && names.empty()) return by_table(map, label, warn);
  if (found.empty())
    throw Error(map.path.string() + ": has no segment '" + label + "'; " + nearest_among(label, names) + "it has " +
                segments_text(map));
  if (found.size() > 1)
    throw Error(formatted("{}: {} segments are called {}: {}; rename them, or give another number or name",
                          map.path.string(), found.size(), label, segments_text(map)));
  return *found[0];
}

Volume mask_of(const LabelMap& map, const Segment& segment) {
  const std::vector<float>& layer = map.layers[segment.layer];
  const Grid& grid = map.grid;
  std::array<int, 3> first = grid.size, last{-1, -1, -1};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        if (layer[grid.offset(x, y, z)] != float(segment.number)) continue;
        const std::array<int, 3> at{x, y, z};
        for (std::size_t k = 0; k < 3; ++k) first[k] = std::min(first[k], at[k]), last[k] = std::max(last[k], at[k]);
      }
  if (last[0] < 0)
    throw Error(formatted("{}: its header lists the segment {} '{}', but no voxel is of it", map.path.string(),
                          segment.number, segment.name));
  Volume mask;
  mask.grid = grid;
  for (std::size_t k = 0; k < 3; ++k) {
    first[k] = std::max(0, first[k] - kMaskBorder);
    mask.grid.size[k] = std::min(grid.size[k] - 1, last[k] + kMaskBorder) - first[k] + 1;
  }
  mask.grid.origin_mm = grid.point_from_index(Eigen::Vector3d(first[0], first[1], first[2]));
  mask.values.reserve(mask.grid.count());
  for (int z = 0; z < mask.grid.size[2]; ++z)
    for (int y = 0; y < mask.grid.size[1]; ++y)
      for (int x = 0; x < mask.grid.size[0]; ++x)
        mask.values.push_back(layer[grid.offset(x + first[0], y + first[1], z + first[2])] == float(segment.number));
  return mask;
}

}  // namespace marrow::files
