// SPDX-License-Identifier: Apache-2.0
#pragma once
// Surfaces in all formats that marrow reads, and in those that it writes for other programs.
#include <filesystem>
#include <string>

#include "marrow/runtime/node/context.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"

namespace marrow::exchange {

/// Reads a triangle surface from .stl, .ply (files::read_marked_mesh()), .obj or .vtp. Points with equal coordinates
/// are merged; faces with more corners are cut into triangles. If the file says that its coordinates are RAS, as 3D
/// Slicer marks them, they become LPS; all others are kept. Coordinates are multiplied by `scale`, which must make them
/// mm. A closed surface whose triangles face inwards is turned. Warns of that, and of a surface that is open, crosses
/// itself, faces different sides, has a size that no bone or implant has, or whose file names two frames. Throws Error
/// for another extension, a damaged file, or a mesh that check_mesh() refuses.
Mesh read_surface_file(const std::filesystem::path& path, double scale, const Context& context);

/// A whole Wavefront OBJ file, and a whole .vtp file of VTK. Both say that the coordinates are LPS. Reading gives
/// exactly the same numbers. Throw Error if check_mesh() refuses the mesh.
std::string obj_text(const Mesh& mesh);
std::string vtp_bytes(const Mesh& mesh);

/// What an OBJ or VTP file holds.
struct FilePolygons {
  files::Polygons polygons;
  files::SpaceMark space;
};
FilePolygons read_obj(const std::filesystem::path& path);
FilePolygons read_vtp(const std::filesystem::path& path);

constexpr std::uint64_t kMostSurfaceBytes = std::uint64_t(4) << 30;

}  // namespace marrow::exchange
