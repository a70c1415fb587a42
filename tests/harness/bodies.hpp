// SPDX-License-Identifier: Apache-2.0
#pragma once
// Closed surfaces of known size and place, besides those of tests/framework/domain/shapes.hpp and of
// marrow/toolbox/analytic/body.hpp.
#include <Eigen/Geometry>
#include <marrow/domain/mesh.hpp>

#include "tests/framework/domain/shapes.hpp"

namespace marrow::test {

inline Mesh box_between(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm) {
  return box((low_mm + high_mm) / 2, high_mm - low_mm);
}
/// A cylinder about z, whose corners lie on the radius.
inline Mesh upright_cylinder(double radius_mm, double low_mm, double high_mm, std::uint32_t sides = 720) {
  return cylinder({0, 0, (low_mm + high_mm) / 2}, Eigen::Vector3d::UnitZ(), radius_mm, high_mm - low_mm, sides);
}

/// The extent of the vertices for which `counts` is true.
template <class Counts>
Eigen::AlignedBox3d extent(const Mesh& mesh, const Counts& counts) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices_mm)
    if (counts(vertex)) box.extend(vertex);
  return box;
}
inline Eigen::AlignedBox3d extent(const Mesh& mesh) {
  return extent(mesh, [](const auto&) { return true; });
}

/// Without its last triangle, so that it is open.
inline Mesh opened(Mesh mesh) {
  mesh.triangles.pop_back();
  return mesh;
}

}  // namespace marrow::test
