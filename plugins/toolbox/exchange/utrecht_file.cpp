// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/utrecht_file.hpp"

#include <cmath>
#include <sstream>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/exchange/cameras.hpp"
#include "marrow/toolbox/files/samples.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::exchange {
namespace {

namespace fs = std::filesystem;
using files::FreeKeys, files::InputFile, files::Samples, files::YamlFile, files::YamlMap;

const std::vector<std::string> kKeys{"marrow-utrecht", "volume", "projections", "objects", "starts"};
const std::vector<std::pair<std::string, Samples::Type>> kTypes{{"uint8", Samples::Type::u8},
                                                                {"int16", Samples::Type::i16},
                                                                {"uint16", Samples::Type::u16},
                                                                {"float32", Samples::Type::f32}};

/// The samples of a raw file. It must hold exactly `count` of them.
std::vector<float> raw_values(const fs::path& path, std::size_t count, Samples::Type type, bool big_endian) {
  const InputFile file(path);
  const std::uint64_t expected = std::uint64_t(count) * files::bytes_each(type);
  if (file.size() != expected)
    throw Error(formatted("{}: has {} bytes; its size and type in the description ask for {}", path.string(),
                          file.size(), expected));
  files::StoredSamples stored;
  stored.type = type;
  stored.big_endian = big_endian;
  stored.count = count;
  return files::read_floats(file, stored);
}

/// The keys that a raw file has in a description: where it is and how its samples are stored.
struct RawFile {
  fs::path path;
  Samples::Type type = Samples::Type::u8;
  bool big_endian = false;
};

std::optional<fs::path> path_in(const YamlMap& map, const std::string& key) {
  const auto text = map.text(key);
  if (!text) return std::nullopt;
  return map.file().path().parent_path() / *text;
}

std::optional<RawFile> raw_file(const YamlMap& map) {
  RawFile raw;
  const auto path = path_in(map, "file");
  const auto type = map.text("type");
  raw.big_endian = map.boolean_or("big_endian", false);
  if (!path || !type) return std::nullopt;
  raw.path = *path;
  for (const auto& [name, value] : kTypes)
    if (name == *type) return raw.type = value, raw;
  map.fault("type", "type: expected uint8, int16, uint16 or float32, got '" + *type + "'");
  return std::nullopt;
}

bool whole_sizes(const YamlMap& map, const std::string& key, std::size_t count, std::vector<int>& sizes) {
  const auto numbers = map.numbers(key, count);
  if (!numbers) return false;
  for (const double number : *numbers) {
    if (!(number >= 1 && number <= 65536) || number != std::floor(number))
      return map.fault(key, key + ": expected whole numbers from 1 to 65536"), false;
    sizes.push_back(int(number));
  }
  return true;
}

void read_volume(const YamlMap& map, UtrechtData& data) {
  const auto raw = raw_file(map);
  std::vector<int> size;
  const bool has_size = whole_sizes(map, "size", 3, size);
  const auto voxel = map.vector3("voxel_mm");
  const double offset = map.has("value_offset_hu") ? map.number("value_offset_hu").value_or(0) : 0;
  const auto pose = map.matrix("world_from_volume", 4, 4);
  if (!raw || !has_size || !voxel || !pose) return;
  const auto rotation = rotation_near(pose->topLeftCorner<3, 3>());
  if (!rotation || (pose->row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    return map.fault("world_from_volume", "world_from_volume: expected a rotation and a translation");
  data.world_from_volume.rotation = *rotation;
  data.world_from_volume.translation_mm = pose->topRightCorner<3, 1>();
  Grid& grid = data.volume.grid;
  grid.size = {size[0], size[1], size[2]};
  grid.spacing_mm = *voxel;
  data.volume.values = raw_values(raw->path, grid.count(), raw->type, raw->big_endian);
  for (float& value : data.volume.values) value += float(offset);
  check_volume(data.volume, raw->path.string());
}

void read_objects(const YamlMap& map, UtrechtData& data) {
  for (const std::string& name : map.keys()) {
    const YamlMap one(map.file(), map.node(name), "object '" + name + "'", {"centre_mm", "mask", "masks"});
    UtrechtObject object;
    const auto centre = one.vector3("centre_mm");
    if (centre) object.centre_mm = *centre;
    if (one.has("mask"))
      if (const auto mask = path_in(one, "mask"); mask && !map.file().has_faults())
        for (const float value : raw_values(*mask, data.volume.grid.count(), Samples::Type::u8, false))
          object.inside.push_back(value != 0);
    data.objects.add(name, std::move(object));
  }
}

/// Lines of six numbers: translations in mm, then rotations in degrees. A line that begins with # is a comment.
std::vector<UtrechtStart> read_starts(const fs::path& path) {
  std::istringstream lines(files::read_text(path, 1 << 20));
  std::vector<UtrechtStart> starts;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t") == std::string::npos || line[line.find_first_not_of(" \t")] == '#') continue;
    for (char& c : line)
      if (c == ',' || c == ';') c = ' ';
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    UtrechtStart start;
    for (double* value : {&start.translation_mm[0], &start.translation_mm[1], &start.translation_mm[2],
                          &start.rotation_deg[0], &start.rotation_deg[1], &start.rotation_deg[2]})
      words >> *value;
    std::string more;
    if (!words || words >> more || !start.translation_mm.allFinite() || !start.rotation_deg.allFinite())
      throw Error(
          formatted("{}:{}: expected six numbers: translations along x, y, z in mm, then rotations about them "
                    "in degrees",
                    path.string(), number));
    starts.push_back(start);
  }
  if (starts.empty()) throw Error(path.string() + ": has no starts");
  return starts;
}

cv::Mat turned(cv::Mat pixels, Mirror mirror) {
  if (mirror == Mirror::left_right) cv::flip(pixels, pixels, 1);
  return pixels;
}

cv::Mat image_of(std::vector<float> values, const std::vector<int>& size) {
  return cv::Mat(size[1], size[0], CV_32F, values.data()).clone();
}

void read_projection(const YamlMap& map, const std::string& name, const std::optional<fs::path>& mask,
                     List<UtrechtView>& views) {
  const auto raw = raw_file(map);
  std::vector<int> size;
  const bool has_size = whole_sizes(map, "size_px", 2, size);
  const auto detector = has_size ? files::detector_from(map, size[0], size[1]) : std::nullopt;
  if (!raw || !detector) return;
  const files::Projection p = files::projection_of(*detector);
  const Mirror mirror = p.leftCols<3>().determinant() < 0 ? Mirror::left_right : Mirror::none;
  UtrechtView seen;
  seen.view.name = name;
  seen.view.camera = camera_of(p, {size[0], size[1]}, mirror, "projection '" + name + "'");
  const std::size_t count = std::size_t(size[0]) * std::size_t(size[1]);
  seen.view.image.pixels = turned(image_of(raw_values(raw->path, count, raw->type, raw->big_endian), size), mirror);
  if (mask) {
    cv::Mat values = turned(image_of(raw_values(*mask, count, Samples::Type::u8, false), size), mirror);
    seen.object = cv::Mat1b(values != 0);
  }
  check_view(seen.view);
  views.add(name, std::move(seen));
}

}  // namespace

UtrechtData read_utrecht(const fs::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "the description", kKeys);
  files::check_version(map, "marrow-utrecht");
  UtrechtData data;
  if (const auto volume = map.required("volume"))
    read_volume(YamlMap(file, *volume, "volume",
                        {"file", "type", "big_endian", "size", "voxel_mm", "value_offset_hu", "world_from_volume"}),
                data);
  if (const auto objects = map.required("objects")) read_objects(YamlMap(file, *objects, "objects", FreeKeys{}), data);
  if (map.has("starts"))
    if (const auto starts = path_in(map, "starts"); starts && !file.has_faults()) data.starts = read_starts(*starts);
  if (!file.has_faults() && data.objects.empty()) map.fault("objects", "objects: expected at least one by name");
  file.finish();
  return data;
}

List<UtrechtView> read_utrecht_views(const fs::path& path, const std::string& object) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "the description", kKeys);
  List<UtrechtView> views;
  // The masks of the object by projection.
  std::vector<std::pair<std::string, fs::path>> masks;
  const YamlMap objects(file, map.node("objects"), "objects", FreeKeys{});
  const YamlMap one(file, objects.node(object), "object '" + object + "'", {"centre_mm", "mask", "masks"});
  if (one.has("masks")) {
    const YamlMap by_projection(file, one.node("masks"), "masks", FreeKeys{});
    for (const std::string& name : by_projection.keys())
      if (const auto mask = path_in(by_projection, name)) masks.emplace_back(name, *mask);
  }
  if (const auto projections = map.required("projections")) {
    const YamlMap by_name(file, *projections, "projections", FreeKeys{});
    for (const std::string& name : by_name.keys()) {
      std::optional<fs::path> mask;
      for (const auto& [of, where] : masks)
        if (of == name) mask = where;
      read_projection(YamlMap(file, by_name.node(name), "projection '" + name + "'",
                              {"file", "type", "big_endian", "size_px", "pixel_mm", "source_mm", "centre_mm",
                               "corner_mm", "columns", "rows"}),
                      name, mask, views);
    }
    for (const auto& [of, where] : masks)
      if (!by_name.has(of)) one.fault("masks", "masks: there is no projection '" + of + "'");
  }
  file.finish();
  return views;
}

RigidTransform started(const UtrechtStart& start, const RigidTransform& world_from_volume,
                       const Eigen::Vector3d& centre_mm) {
  const Eigen::Vector3d angles = start.rotation_deg * (EIGEN_PI / 180);
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  RigidTransform pose = world_from_volume;
  pose.rotation = turn * world_from_volume.rotation;
  pose.translation_mm = turn * (world_from_volume.translation_mm - centre_mm) + centre_mm + start.translation_mm;
  return pose;
}

}  // namespace marrow::exchange
