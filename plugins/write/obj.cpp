// SPDX-License-Identifier: Apache-2.0
// A surface as Wavefront OBJ, in mm.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"

namespace {

marrow::exchange::ObjFile obj(const marrow::Mesh& mesh) { return {marrow::exchange::obj_text(mesh)}; }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.obj", obj)
      .summary("Gives a surface as Wavefront OBJ")
      .in("mesh", "the surface")
      .out("obj", "vertices in mm, and triangles; 3D Slicer reads from it that the coordinates are LPS");
  plugin.writer<marrow::exchange::ObjFile>(".obj", marrow::exchange::write_file, "Wavefront OBJ surface in mm");
}
