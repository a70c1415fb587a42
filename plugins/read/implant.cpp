// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <tuple>

#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "marrow/toolbox/geometry/implant.hpp"

namespace {

using namespace marrow;
using files::FreeKeys, files::YamlFile, files::YamlMap;
using geometry::Hole, geometry::Implant;

struct Options {
  std::filesystem::path holes;
  std::filesystem::path surface;
  double scale = 1;
};

Hole hole_from(const YamlMap& map, const std::string& name) {
  Hole hole;
  hole.name = name;
  if (const auto centre = map.vector3("centre_mm")) hole.centre_mm = *centre;
  if (const auto axis = map.vector3("axis")) {
    if (axis->norm() > 1e-9)
      hole.axis = axis->normalized();
    else
      map.fault("axis", "axis: expected a direction, such as [1, 0, 0], got one of length 0");
  }
  if (const auto diameter = map.number("diameter_mm")) {
    hole.diameter_mm = *diameter;
    if (!(*diameter > 0)) map.fault("diameter_mm", formatted("diameter_mm: expected more than 0, got {:f}", *diameter));
  }
  return hole;
}

std::vector<Hole> read_holes(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "implant", {"marrow-implant", "holes"});
  files::check_version(map, "marrow-implant");
  std::vector<Hole> read;
  if (const auto holes = map.required("holes")) {
    const YamlMap by_name(file, *holes, "holes", FreeKeys{});
    if (by_name.valid() && by_name.keys().empty())
      map.fault("holes", "holes: expected holes by name, got none; an implant without holes cannot be locked");
    for (const std::string& name : by_name.keys())
      read.push_back(hole_from(
          YamlMap(file, by_name.node(name), "hole '" + name + "'", {"centre_mm", "axis", "diameter_mm"}), name));
  }
  file.finish();
  return read;
}

std::tuple<Implant, Mesh> implant(const Options& options, Context& context) {
  Implant implant;
  implant.holes = read_holes(options.holes);
  implant.surface = exchange::read_surface_file(options.surface, options.scale, context);
  implant.surface.frame = "implant";
  geometry::check_implant(implant, "read.implant: " + options.surface.string());
  return {implant, implant.surface};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.implant", implant)
      .summary("Reads an implant: its closed surface from STL, PLY, OBJ or VTP, and its holes from YAML")
      .out("implant", "surface and holes, in mm")
      .out("mesh", "the surface alone")
      .option("holes", &Options::holes, "YAML file with the centre, the axis and the diameter of each hole", required())
      .option("surface", &Options::surface, "file of the surface: .stl, .ply, .obj or .vtp", required())
      .option("scale", &Options::scale, "factor that converts the surface's unit to mm: 1000 for metres",
              at_least(1e-6));
}
