// SPDX-License-Identifier: Apache-2.0
// In the place of vtp.cpp where marrow is built without VTK. The node write.vtp is not there then.
#include "marrow/toolbox/exchange/surface_file.hpp"

namespace marrow::exchange {

FilePolygons read_vtp(const std::filesystem::path& path) {
  throw Error(path.string() + ": this build of marrow leaves out VTK, which reads .vtp; configure it with " +
              "-DMARROW_VTK=ON, or export the surface as .ply, .stl or .obj");
}

std::string vtp_bytes(const Mesh&) {
  throw Error("this build of marrow leaves out VTK, which writes .vtp; configure it with -DMARROW_VTK=ON");
}

}  // namespace marrow::exchange
