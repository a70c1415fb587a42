// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/toolbox/exchange/markups.hpp"
#include "marrow/toolbox/exchange/xreg_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace {

using namespace marrow;
using files::FreeKeys, files::YamlFile, files::YamlMap;

struct Options {
  std::filesystem::path path;
  std::string fragment = "bone";
  std::filesystem::path seen;
  std::vector<std::string> names;
  std::string mirror = "none";
};

/// Notes a fault if no point in the CT has the name of a seen or tracked point.
void check_known(const YamlMap& places, const YamlMap& map, const std::string& name) {
  if (places.has(name)) return;
  const std::string near = map.file().is_full() ? "" : nearest_name(name, places.keys());
  map.fault(name, "the points have no '" + name + "'; " +
                      (near.empty() ? "give its place in the CT under 'points'" : "did you mean '" + near + "'?"));
}

/// Where a view shows a point: [u, v] or [u, v, deviation_px].
void read_seen(const YamlMap& pixels, const std::string& name, const std::string& view, Landmarks& landmarks) {
  const YAML::Node written = pixels.node(name);
  const bool has_deviation = written.IsSequence() && written.size() == 3;
  if (!has_deviation && !(written.IsSequence() && written.size() == 2)) {
    pixels.fault(name, name + ": expected [u, v] or [u, v, deviation_px], got " + yaml_described(written));
    return;
  }
  const auto numbers = pixels.numbers(name, has_deviation ? 3 : 2);
  if (!numbers) return;
  if (has_deviation && !((*numbers)[2] > 0))
    pixels.fault(name, formatted("{}: its deviation must be greater than 0 px, got {}; leave it out if it is not known",
                                 name, (*numbers)[2]));
  landmarks.seen.push_back({name, view, {(*numbers)[0], (*numbers)[1]}, has_deviation ? (*numbers)[2] : 0});
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
        read_seen(pixels, name, view, landmarks);
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

/// Adds where xReg's projections show the landmarks.
void add_seen(Landmarks& landmarks, const Options& options) {
  const std::string what = options.seen.string();
  const std::vector<exchange::XregProjection> projections = exchange::read_xreg(options.seen);
  if (options.names.size() != projections.size())
    throw Error(formatted("{}: has {} projections; give as many names, got {}", what, projections.size(),
                          options.names.size()));
  for (std::size_t i = 0; i < projections.size(); ++i) {
    check_item_name("view", options.names[i]);
    for (const auto& shown : exchange::landmarks_of(projections[i], exchange::mirror_of(options.mirror))) {
      const auto is_it = [&](const Landmarks::Point& point) { return point.name == shown.name; };
      if (std::none_of(landmarks.points.begin(), landmarks.points.end(), is_it))
        throw Error(formatted("{}: projection {} shows '{}', but {} does not have it; give its place in the CT there",
                              what, i, shown.name, options.path.string()));
      landmarks.seen.push_back({shown.name, options.names[i], shown.pixel});
    }
  }
}

List<Landmarks> marked_landmarks(const Options& options) {
  check_item_name("fragment", options.fragment);
  Landmarks landmarks = exchange::read_marked_landmarks(options.path);
  if (!options.seen.empty()) add_seen(landmarks, options);
  List<Landmarks> by_fragment;
  by_fragment.add(options.fragment, std::move(landmarks));
  return by_fragment;
}

List<Landmarks> landmarks(const Options& options) {
  if (options.seen.empty() && (!options.names.empty() || options.mirror != "none"))
    throw Error(options.path.string() + ": names and mirror are about the file of seen; give it, or leave them out");
  if (exchange::is_markups_file(options.path)) return marked_landmarks(options);
  if (!options.seen.empty())
    throw Error(options.path.string() +
                ": says itself where views show the landmarks; seen is only for points of 3D Slicer, so leave it out");
  List<Landmarks> landmarks;
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
              "file with landmarks; .mrk.json or .fcsv: 3D Slicer's points, any other: marrow's YAML", required())
      .option("fragment", &Options::fragment, "only for 3D Slicer's files: the fragment of the points")
      .option(
          "seen", &Options::seen,
          "only for 3D Slicer's files: projection data of xReg (.h5), which say where its images show the landmarks")
      .option("names", &Options::names, "names of the views, in the order of xReg's projections")
      .option("mirror", &Options::mirror, "how xReg's images are turned over before use, as for read.camera",
              one_of({"none", "left_right", "upside_down"}));
}
