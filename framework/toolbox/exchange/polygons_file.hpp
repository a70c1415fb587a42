// SPDX-License-Identifier: Apache-2.0
#pragma once
// The readers of single formats of surfaces.
#include <filesystem>

#include "marrow/toolbox/files/mesh_file.hpp"

namespace marrow::exchange {

/// What an OBJ or VTP file holds. `is_ras`: it says that its coordinates are RAS.
struct FilePolygons {
  files::Polygons polygons;
  bool is_ras = false;
};
FilePolygons read_obj(const std::filesystem::path& path);
FilePolygons read_vtp(const std::filesystem::path& path);

constexpr std::uint64_t kMostSurfaceBytes = std::uint64_t(4) << 30;

}  // namespace marrow::exchange
