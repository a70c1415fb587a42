// SPDX-License-Identifier: Apache-2.0
#pragma once
// Meshes of known size and place for tests.
#include <Eigen/Geometry>
#include <cmath>
#include <marrow/domain/mesh.hpp>

namespace marrow::test {

/// A box with its faces along the axes, 12 triangles, closed, normals outward.
inline Mesh box(const Eigen::Vector3d& centre_mm, const Eigen::Vector3d& size_mm) {
  Mesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d side(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
    mesh.vertices_mm.push_back(centre_mm + side.cwiseProduct(size_mm));
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// A closed cylinder about `axis` (unit length), with `sides` flat sides and a fan on each end.
inline Mesh cylinder(const Eigen::Vector3d& centre_mm, const Eigen::Vector3d& axis, double radius_mm, double length_mm,
                     std::uint32_t sides) {
  const Eigen::Vector3d across = axis.unitOrthogonal(), other = axis.cross(across);
  Mesh mesh;
  for (double end : {-0.5, 0.5})
    for (std::uint32_t i = 0; i < sides; ++i) {
      const double angle = 2 * 3.14159265358979323846 * i / sides;
      mesh.vertices_mm.push_back(centre_mm + end * length_mm * axis +
                                 radius_mm * (std::cos(angle) * across + std::sin(angle) * other));
    }
  const std::uint32_t bottom = 2 * sides, top = bottom + 1;
  mesh.vertices_mm.push_back(centre_mm - 0.5 * length_mm * axis);
  mesh.vertices_mm.push_back(centre_mm + 0.5 * length_mm * axis);
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t next = (i + 1) % sides;
    mesh.triangles.push_back({i, next, sides + next});
    mesh.triangles.push_back({i, sides + next, sides + i});
    mesh.triangles.push_back({bottom, next, i});
    mesh.triangles.push_back({top, sides + i, sides + next});
  }
  return mesh;
}

}  // namespace marrow::test
