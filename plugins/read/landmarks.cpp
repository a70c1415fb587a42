// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/domain/names.hpp"
#include "marrow/toolbox/exchange/marked_values.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace {

using namespace marrow;
using files::FreeKeys, files::YamlFile, files::YamlMap;

struct Options {
  std::filesystem::path path;
  std::string fragment = "bone";
};

/// Notes a fault if the points in the CT have none with the name of a seen or tracked point.
void check_known(const YamlMap& places, const YamlMap& map, const std::string& name) {
  if (places.has(name)) return;
  const std::string near = map.file().is_full() ? "" : nearest_name(name, places.keys());
  map.fault(name, "the points have no '" + name + "'; " +
                      (near.empty() ? "give its place in the CT under 'points'" : "did you mean '" + near + "'?"));
}

Landmarks landmarks_of(const YamlMap& fragment, YamlFile& file) {
  Landmarks landmarks;
  const auto points = fragment.required("points");
  if (!points) return landmarks;
  const YamlMap places(file, *points, fragment.what() + ", points", FreeKeys{});
  for (const std::string& name : places.keys()) {
    const auto place = places.vector3(name);
    landmarks.points.push_back({name, place.value_or(Eigen::Vector3d::Zero())});
  }
  if (places.valid() && landmarks.points.empty())
    fragment.fault("points", "points: expected places [x, y, z] in mm by name, got none");
  if (const YAML::Node seen = fragment.node("seen"); seen.IsDefined()) {
    const YamlMap views(file, seen, fragment.what() + ", seen", FreeKeys{});
    for (const std::string& view : views.keys()) {
      const YamlMap pixels(file, views.node(view), fragment.what() + ", seen, view '" + view + "'", FreeKeys{});
      for (const std::string& name : pixels.keys()) {
        check_known(places, pixels, name);
        if (const auto pixel = pixels.numbers(name, 2))
          landmarks.seen.push_back({name, view, {(*pixel)[0], (*pixel)[1]}});
      }
    }
  }
  if (const YAML::Node tracked = fragment.node("tracked"); tracked.IsDefined()) {
    const YamlMap found(file, tracked, fragment.what() + ", tracked", FreeKeys{});
    for (const std::string& name : found.keys()) {
      check_known(places, found, name);
      if (const auto place = found.vector3(name)) landmarks.tracked.push_back({name, *place});
    }
  }
  return landmarks;
}

List<Landmarks> landmarks(const Options& options) {
  List<Landmarks> landmarks;
  if (exchange::is_markups_file(options.path)) {
    check_item_name("fragment", options.fragment);
    landmarks.add(options.fragment, exchange::read_marked_landmarks(options.path));
    return landmarks;
  }
  YamlFile file(options.path);
  const YamlMap map(file, file.root(), "landmarks", {"marrow-landmarks", "fragments"});
  files::check_version(map, "marrow-landmarks");
  if (const auto fragments = map.required("fragments")) {
    const YamlMap by_name(file, *fragments, "fragments", FreeKeys{});
    if (by_name.valid() && by_name.keys().empty())
      map.fault("fragments", "fragments: expected fragments by name, got none");
    for (const std::string& name : by_name.keys())
      landmarks.add(
          name, landmarks_of(
                    YamlMap(file, by_name.node(name), "fragment '" + name + "'", {"points", "seen", "tracked"}), file));
  }
  file.finish();
  return landmarks;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.landmarks", landmarks)
      .summary(
          "Reads landmarks or markers of each fragment from marrow's YAML: their positions in the CT, in the images, "
          "and in the world as measured by a tracking system; or their positions in the CT from 3D Slicer's points")
      .out("landmarks", "points in CT coordinates (mm), in pixels of views, and in world coordinates (mm)",
           over("fragment"))
      .option("path", &Options::path,
              "file with landmarks; .mrk.json, .json or .fcsv: 3D Slicer's points, any other: marrow's YAML",
              required())
      .option("fragment", &Options::fragment, "only for 3D Slicer's files: the fragment of the points");
}
