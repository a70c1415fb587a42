// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/surface_file.hpp"

namespace {

struct Options {
  std::filesystem::path path;
  double scale = 1;
  std::string coordinates = "ct";
};

marrow::Mesh mesh(const Options& options, marrow::Context& context) {
  marrow::Mesh mesh = marrow::exchange::read_surface_file(options.path, options.scale, context);
  mesh.frame = options.coordinates;
  return mesh;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.mesh", mesh)
      .summary(
          "Reads a surface from STL, PLY, OBJ or VTP; equal vertices are merged, and a closed surface that faces "
          "inwards is turned")
      .out("mesh", "the surface in mm")
      .option("path", &Options::path,
              "file; its end says the format: .stl, .ply, .obj or .vtp; where it says SPACE=RAS, it becomes LPS",
              marrow::required())
      .option("scale", &Options::scale, "factor that converts the file's unit to mm: 10 for cm, 1000 for metres",
              marrow::at_least(1e-6))
      .option("coordinates", &Options::coordinates,
              "frame of the file's coordinates: ct, or world (for a surface that was tracked)",
              marrow::one_of({"ct", "world"}));
}
