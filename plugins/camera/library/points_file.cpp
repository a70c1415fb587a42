// SPDX-License-Identifier: Apache-2.0
#include "marrow/camera/points_file.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::files {
namespace {

std::optional<KnownPoint> point_from(YamlFile& file, const YAML::Node& node, std::size_t number) {
  const YamlMap map(file, node, formatted("point {}", number), {"name", "at_mm", "seen_px"});
  if (!map.valid()) return std::nullopt;
  KnownPoint point;
  point.name = map.has("name") ? map.text("name").value_or("") : formatted("{}", number);
  if (map.has("at_mm")) point.world_mm = map.vector3("at_mm");
  const auto seen = map.required("seen_px");
  if (!seen) return std::nullopt;
  if (!seen->IsMap() || seen->size() == 0) {
    map.fault("seen_px", "seen_px: expected the point's place per view, as {frontal: [u, v]}");
    return std::nullopt;
  }
  const YamlMap places(file, *seen, map.what() + ": seen_px", FreeKeys{});
  for (const std::string& view : places.keys())
    if (const auto at = places.numbers(view, 2)) point.seen_px[view] = {(*at)[0], (*at)[1]};
  if (!point.world_mm && point.seen_px.size() < 2)
    map.fault("seen_px", "a point without at_mm needs to be seen in two views, from which its place follows");
  return point;
}

}  // namespace

std::vector<KnownPoint> read_points_file(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "points", {"marrow-points", "points"});
  check_version(map, "marrow-points");
  std::vector<KnownPoint> points;
  if (const auto list = map.required("points")) {
    if (!list->IsSequence() || list->size() == 0)
      map.fault("points", "points: expected a list of points, each with at_mm and seen_px");
    else
      for (const auto& item : *list)
        if (auto point = point_from(file, item, points.size() + 1)) points.push_back(std::move(*point));
  }
  file.finish();
  return points;
}

}  // namespace marrow::files
