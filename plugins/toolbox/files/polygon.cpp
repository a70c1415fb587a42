// SPDX-License-Identifier: Apache-2.0
// Faces of more than three corners, cut into triangles.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"
#include "mesh_parts.hpp"

namespace marrow::files {
namespace {

constexpr std::size_t kMostStarts = 64;  // for a fan: no program makes faces of more corners that are not convex

/// Whether a fan of triangles from one corner covers the face exactly once: all triangles face the same side, and the
/// fan turns less than once around that corner.
bool is_covered_from(std::size_t start, const std::vector<Eigen::Vector3d>& corners) {
  const std::size_t count = corners.size();
  Eigen::Vector3d all = Eigen::Vector3d::Zero();
  const auto edges = [&](std::size_t i) {
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>{corners[(start + i) % count] - corners[start],
                                                       corners[(start + i + 1) % count] - corners[start]};
  };
  for (std::size_t i = 1; i + 1 < count; ++i) all += edges(i).first.cross(edges(i).second);
  double size = 0, turned = 0;
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const auto [from, to] = edges(i);
    const Eigen::Vector3d normal = from.cross(to);
    if (normal.dot(all) < -1e-3 * all.squaredNorm()) return false;  // more than the rounding of a straight corner
    size += normal.norm();
    turned += std::atan2(normal.norm(), from.dot(to));
  }
  return !(size > 2 * all.norm()) && !(turned > 6.2832);
}

/// The corner from which a face of more than three corners is cut into a fan of triangles. Throws Error if there is
/// none.
std::size_t start_of_fan(const std::vector<std::uint32_t>& polygon, const MeshBuilder& builder,
                         const std::string& what) {
  std::vector<Eigen::Vector3d> corners;
  for (const std::uint32_t vertex : polygon) corners.push_back(builder.mesh.vertices_mm[vertex]);
  for (std::size_t start = 0; start < std::min(polygon.size(), kMostStarts); ++start) {
    if (is_covered_from(start, corners)) return start;
    if (polygon.size() > kMostStarts) break;
  }
  throw Error(
      formatted("{}: a face of {} corners is far from convex or flat, or crosses itself, so its triangles are not "
                "certain; save the surface as triangles",
                what, polygon.size()));
}

}  // namespace

void add_polygon(const std::vector<std::uint32_t>& polygon, MeshBuilder& builder, const std::string& what) {
  const std::size_t count = polygon.size(), start = count > 3 ? start_of_fan(polygon, builder, what) : 0;
  for (std::size_t i = 1; i + 1 < count; ++i)
    builder.triangle(polygon[start], polygon[(start + i) % count], polygon[(start + i + 1) % count]);
}

Mesh mesh_of(const Polygons& polygons, const std::string& what) {
  MeshBuilder builder(polygons.corner_counts.size());
  std::vector<std::uint32_t> index;
  index.reserve(polygons.points_mm.size());
  for (const Eigen::Vector3d& point : polygons.points_mm) index.push_back(builder.vertex(point));
  std::size_t at = 0;
  std::vector<std::uint32_t> face;
  for (const std::uint32_t count : polygons.corner_counts) {
    face.clear();
    for (std::uint32_t i = 0; i < count; ++i) face.push_back(index[polygons.corners[at++]]);
    add_polygon(face, builder, what);
  }
  return std::move(builder.mesh);
}

}  // namespace marrow::files
