// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string_view>

#include "marrow/domain/mesh.hpp"

namespace marrow::files {

/// What the comments of a surface's file say about its coordinates. 3D Slicer writes SPACE=LPS or SPACE=RAS into them.
/// The first such mark of a file counts, because later ones tell where it came from ("converted from SPACE=RAS").
class SpaceMark {
 public:
  /// Looks for marks in a comment. The comments must be given in the order of the file.
  void look_into(std::string_view comment);
  bool is_ras() const { return first_ == Space::ras; }
  /// Whether a later mark says the opposite of the first one.
  bool is_contradicted() const { return is_contradicted_; }

 private:
  enum class Space { unknown, lps, ras };
  Space first_ = Space::unknown;
  bool is_contradicted_ = false;
};

/// A surface with the numbers of its file, and what the file says about its coordinates.
struct MarkedMesh {
  Mesh mesh;
  SpaceMark space;
};

/// Reads a triangle surface from STL (text or binary) or PLY (text or binary in either byte order). Vertices with equal
/// coordinates are merged. Triangles with two equal corners are left out. Throws Error for another extension or a
/// damaged file.
MarkedMesh read_marked_mesh(const std::filesystem::path& path);

/// The surface in LPS: coordinates that are marked as RAS are turned by 180 degrees about z. Then they are multiplied
/// by `scale`, which must make them mm. Throws Error if check_mesh() refuses the result; `what` names the file.
Mesh in_lps_mm(MarkedMesh marked, double scale, const std::string& what);

/// Both of the above. exchange::read_surface_file() reads more formats, and looks for faults.
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
