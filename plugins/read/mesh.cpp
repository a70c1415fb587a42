// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/surface_file.hpp"

namespace {

struct Options {
  std::filesystem::path path;
  double scale = 1;
  std::string frame = "ct";
};

marrow::Mesh mesh(const Options& options, marrow::Context& context) {
  marrow::Mesh mesh = marrow::exchange::read_surface_file(options.path, options.scale);
  mesh.frame = options.frame;
  const auto largest = [&] {
    Eigen::AlignedBox3d box;
    for (const auto& vertex : mesh.vertices_mm) box.extend(vertex);
    return box.sizes().maxCoeff();
  }();
  if (largest < 1)
    context.warn(options.path.string() + ": the surface is only " + std::to_string(largest) +
                 " mm large; is it in metres? Then give scale: 1000");
  return mesh;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.mesh", mesh)
      .summary("Reads a surface from STL, PLY, OBJ or VTP; equal vertices are merged")
      .out("mesh", "the surface in mm")
      .option("path", &Options::path,
              "file; its end says the format: .stl, .ply, .obj or .vtp; where an .obj or .vtp says RAS, it becomes LPS",
              marrow::required())
      .option("scale", &Options::scale, "factor that converts the file's unit to mm: 1000 for metres",
              marrow::at_least(1e-6))
      .option("frame", &Options::frame,
              "frame of the file's coordinates: ct, or world (for a surface that was tracked)",
              marrow::one_of({"ct", "world"}));
}
