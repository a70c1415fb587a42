// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/field/mesh_field.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "marrow/toolbox/field/interior.hpp"

namespace marrow::field {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;

double squared_distance_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  const double t = std::clamp((p - a).dot(along) / std::max(along.squaredNorm(), 1e-30), 0.0, 1.0);
  return (p - a - t * along).squaredNorm();
}

double distance_to(const Triangle& triangle, const Vector3d& p) {
  const Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  bool over = normal.squaredNorm() > 1e-30;
  double nearest = 1e30;
  for (int k = 0; k < 3; ++k) {
    const Vector3d &a = triangle[k], &b = triangle[(k + 1) % 3];
    over &= (b - a).cross(p - a).dot(normal) >= 0;
    nearest = std::min(nearest, squared_distance_to_segment(p, a, b));
  }
  return over ? std::abs((p - triangle[0]).dot(normal)) / normal.norm() : std::sqrt(nearest);
}

/// Where the line through (x, y) along z meets the triangle. A line exactly through an edge does not count as a
/// crossing: the caller shifts its lines, so that no line meets an edge.
bool crossing(const Triangle& t, double x, double y, double& z) {
  const auto side = [&](const Vector3d& a, const Vector3d& b) {
    return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
  };
  const double u = side(t[1], t[2]), v = side(t[2], t[0]), w = side(t[0], t[1]);
  if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0))) return false;
  z = (u * t[0].z() + v * t[1].z() + w * t[2].z()) / (u + v + w);
  return true;
}

}  // namespace

marrow::SignedField field_of_mesh(const marrow::Grid& grid, const marrow::Mesh& mesh, double band_mm) {
  const auto& size = grid.size;
  const Vector3d spacing = grid.spacing_mm;
  std::vector<float> distance(grid.count(), float(band_mm));
  std::vector<std::vector<float>> crossings(std::size_t(size[0]) * size[1]);
  const double reach_mm = 1.8 * spacing.maxCoeff();
  const Vector3d aside(1.7e-5, 2.3e-5, 0);  // in voxels; so that no line meets an edge
  for (const auto& corners : mesh.triangles) {
    Triangle index, mm;
    for (int k = 0; k < 3; ++k) {
      index[k] = grid.index_from_point(mesh.vertices_mm[corners[k]]);
      mm[k] = index[k].cwiseProduct(spacing);
    }
    const Vector3d least = index[0].cwiseMin(index[1]).cwiseMin(index[2]),
                   most = index[0].cwiseMax(index[1]).cwiseMax(index[2]);
    int low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = std::max(0, int(std::floor(std::clamp(least[k] - reach_mm / spacing[k], -1e6, 1e6))));
      high[k] = std::min(size[k] - 1, int(std::ceil(std::clamp(most[k] + reach_mm / spacing[k], -1e6, 1e6))));
    }
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) {
        double z = 0;
        if (crossing(index, x + aside.x(), y + aside.y(), z))
          crossings[std::size_t(y) * size[0] + std::size_t(x)].push_back(float(z));
        for (int k = low[2]; k <= high[2]; ++k) {
          float& value = distance[grid.offset(x, y, k)];
          value = std::min(value, float(distance_to(mm, Vector3d(x, y, k).cwiseProduct(spacing))));
        }
      }
  }
  for (int y = 0; y < size[1]; ++y)
    for (int x = 0; x < size[0]; ++x) {
      auto& heights = crossings[std::size_t(y) * size[0] + std::size_t(x)];
      std::sort(heights.begin(), heights.end());
      std::size_t passed = 0;
      for (int z = 0; z < size[2]; ++z) {
        while (passed < heights.size() && heights[passed] < float(z)) ++passed;
        float& value = distance[grid.offset(x, y, z)];
        value = std::max(value, 1e-4f);
        if (passed % 2) value = -value;
      }
    }
  march_distances(grid, distance, band_mm);
  return {grid, std::move(distance)};
}

}  // namespace marrow::field
