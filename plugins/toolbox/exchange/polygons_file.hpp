// SPDX-License-Identifier: Apache-2.0
#pragma once
// The readers of single formats of surfaces.
#include <filesystem>

#include "marrow/toolbox/files/mesh_file.hpp"

namespace marrow::exchange {

/// What an OBJ or VTP file holds.
struct FilePolygons {
  files::Polygons polygons;
  files::SpaceMark space;
};
FilePolygons read_obj(const std::filesystem::path& path);
FilePolygons read_vtp(const std::filesystem::path& path);

constexpr std::uint64_t kMostSurfaceBytes = std::uint64_t(4) << 30;

}  // namespace marrow::exchange
