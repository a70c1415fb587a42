// SPDX-License-Identifier: Apache-2.0
// A surface as VTK's XML (.vtp), in mm.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"

namespace {

marrow::exchange::VtpFile vtp(const marrow::Mesh& mesh) { return {marrow::exchange::vtp_bytes(mesh)}; }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.vtp", vtp)
      .summary("Gives a surface as VTK's XML (.vtp), for VTK, ParaView and 3D Slicer")
      .in("mesh", "the surface")
      .out("vtp", "vertices in mm, and triangles; 3D Slicer reads from it that the coordinates are LPS");
  plugin.writer<marrow::exchange::VtpFile>(".vtp", marrow::exchange::write_file, "VTK surface in mm");
}
