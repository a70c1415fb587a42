// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/label_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "dicom_segmentation.hpp"
#include "file_format.hpp"
#include "label_names.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "volume_grid.hpp"

namespace marrow::files {
namespace {

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
