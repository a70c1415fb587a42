// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/mesh.hpp"

namespace marrow::files {

/// Reads a triangle surface from STL (text or binary) or PLY (text or binary in either byte order). Vertices with equal
/// coordinates are merged. Triangles with two equal corners are left out. Coordinates are multiplied by `scale`, which
/// must make them mm. Throws Error for another extension, a damaged file, or a mesh that check_mesh() refuses.
Mesh read_mesh_file(const std::filesystem::path& path, double scale);

/// Points, and faces that name their corners by number: the first face has corner_counts[0] corners, and so on.
struct Polygons {
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<std::uint32_t> corners, corner_counts;
};
/// The same as triangles. Points with equal coordinates are merged, triangles with two equal corners are left out. All
/// corners must be numbers of points. Throws Error for a face that is far from convex or flat; `what` names the file.
Mesh mesh_of(const Polygons& polygons, const std::string& what);

}  // namespace marrow::files
