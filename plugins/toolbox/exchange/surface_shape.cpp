// SPDX-License-Identifier: Apache-2.0
#include "surface_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace marrow::exchange {
namespace {

struct EdgeOfTriangle {
  std::uint64_t corners = 0;  ///< the lower number in the upper half
  std::uint32_t triangle = 0;
  bool rises = false;  ///< it runs from the lower number to the higher one
};

std::vector<EdgeOfTriangle> sorted_edges(const Mesh& mesh) {
  std::vector<EdgeOfTriangle> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3];
      edges.push_back({std::min(a, b) << 32 | std::max(a, b), i, a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const EdgeOfTriangle& a, const EdgeOfTriangle& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.triangle < b.triangle;
  });
  return edges;
}

/// Which triangles are connected.
class Parts {
 public:
  explicit Parts(std::size_t triangles) : parent_(triangles) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t root(std::uint32_t triangle) {
    while (parent_[triangle] != triangle) triangle = parent_[triangle] = parent_[parent_[triangle]];
    return triangle;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t one = root(a), other = root(b);
    parent_[std::max(one, other)] = std::min(one, other);  // so the first triangle of a part is its root
  }

 private:
  std::vector<std::uint32_t> parent_;
};

void add_volumes(const Mesh& mesh, SurfaceShape& shape) {
  std::vector<Eigen::Vector3d> origins;  // one for each part: a far one would cost digits
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const std::uint32_t part = shape.part_of_triangle[i];
    if (part == origins.size()) {
      origins.push_back(mesh.vertices_mm[a]);
      shape.part_volumes_mm3.push_back(0);
    }
    const auto from_origin = [&](std::uint32_t v) -> Eigen::Vector3d { return mesh.vertices_mm[v] - origins[part]; };
    shape.part_volumes_mm3[part] += from_origin(a).dot(from_origin(b).cross(from_origin(c))) / 6;
  }
}

double cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.y() * b.z() - a.z() * b.y(); }

/// How many of the parts that face outwards hold the point: a ray along x leaves each of them once more than it enters.
int outward_parts_around(const Eigen::Vector3d& point, const Mesh& mesh, const SurfaceShape& shape) {
  int left = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!(shape.part_volumes_mm3[shape.part_of_triangle[i]] > 0)) continue;
    const auto& [v0, v1, v2] = mesh.triangles[i];
    const Eigen::Vector3d a = mesh.vertices_mm[v0] - point, b = mesh.vertices_mm[v1] - point,
                          c = mesh.vertices_mm[v2] - point;
    const double of_c = cross(a, b), of_a = cross(b, c), of_b = cross(c, a), sum = of_a + of_b + of_c;
    const bool is_met = (of_a > 0 && of_b > 0 && of_c > 0) || (of_a < 0 && of_b < 0 && of_c < 0);
    if (is_met && (of_a * a.x() + of_b * b.x() + of_c * c.x()) / sum > 0) left += sum > 0 ? 1 : -1;
  }
  return left;
}

}  // namespace

SurfaceShape shape_of(const Mesh& mesh) {
  SurfaceShape shape;
  Parts parts(mesh.triangles.size());
  const std::vector<EdgeOfTriangle> edges = sorted_edges(mesh);
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    for (end = begin; end < edges.size() && edges[end].corners == edges[begin].corners; ++end)
      parts.join(edges[begin].triangle, edges[end].triangle);
    shape.open_edges += end - begin == 1;
    shape.crowded_edges += end - begin > 2;
    shape.contrary_edges += end - begin == 2 && edges[begin].rises == edges[begin + 1].rises;
  }
  std::uint32_t count = 0;
  shape.part_of_triangle.resize(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    shape.part_of_triangle[i] = parts.root(i) == i ? count++ : shape.part_of_triangle[parts.root(i)];
  add_volumes(mesh, shape);
  return shape;
}

std::vector<std::uint32_t> parts_inside_out(const Mesh& mesh, const SurfaceShape& shape) {
  constexpr std::size_t kMostParts = 50;
  constexpr double kNothing = 1e-9;  // of the largest part: its sign is rounding
  const std::vector<double>& volumes = shape.part_volumes_mm3;
  double largest = 0;
  for (const double volume : volumes) largest = std::max(largest, std::abs(volume));
  std::vector<std::uint32_t> inward;
  for (std::uint32_t part = 0; part < volumes.size(); ++part)
    if (volumes[part] < -kNothing * largest) inward.push_back(part);
  std::stable_sort(inward.begin(), inward.end(), [&](auto a, auto b) { return volumes[a] < volumes[b]; });
  inward.resize(std::min(inward.size(), kMostParts));
  std::vector<std::uint32_t> found;
  for (const std::uint32_t part : inward) {
    const auto first = std::find(shape.part_of_triangle.begin(), shape.part_of_triangle.end(), part);
    const auto& [a, b, c] = mesh.triangles[std::size_t(first - shape.part_of_triangle.begin())];
    // Not the centre, because a ray from there might meet edges of regular surfaces.
    const Eigen::Vector3d point =
        0.5137 * mesh.vertices_mm[a] + 0.2713 * mesh.vertices_mm[b] + 0.215 * mesh.vertices_mm[c];
    if (outward_parts_around(point, mesh, shape) <= 0) found.push_back(part);
  }
  return found;
}

}  // namespace marrow::exchange
