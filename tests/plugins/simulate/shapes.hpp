// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bodies whose path lengths and volumes are known.
#include <Eigen/Geometry>
#include <cmath>

#include "marrow/simulate/polygonise.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"
#include "tests/harness/message_of.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::phantom::test {

inline Mesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Mesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.vertices_mm.emplace_back(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z());
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// A closed cylinder along z with `sides` faces, whose corners lie on the radius.
inline Mesh cylinder(double radius, double low, double high, int sides = 720) {
  Mesh mesh;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2 * kPi * k / sides;
    for (double z : {low, high}) mesh.vertices_mm.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  mesh.vertices_mm.emplace_back(0, 0, low);
  mesh.vertices_mm.emplace_back(0, 0, high);
  const std::uint32_t n = std::uint32_t(sides);
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t j = (k + 1) % n, a = 2 * k, b = 2 * j;
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
    mesh.triangles.push_back({2 * n, b, a});
    mesh.triangles.push_back({2 * n + 1, a + 1, b + 1});
  }
  return mesh;
}

inline Mesh sphere(const Eigen::Vector3d& centre, double radius, double spacing) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius + 3 * spacing);
  return polygonise([=](const Eigen::Vector3d& p) { return (p - centre).norm() - radius; }, centre - reach,
                    centre + reach, spacing, 1);
}

/// The extent of the vertices for which `counts` is true.
template <class Counts>
Eigen::AlignedBox3d extent(const Mesh& mesh, const Counts& counts) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices_mm)
    if (counts(vertex)) box.extend(vertex);
  return box;
}

/// A phantom of one whole fragment that does not move.
inline Phantom whole(Mesh outer, Mesh inner = {}) {
  Phantom phantom;
  phantom.bone.outer = std::move(outer);
  phantom.bone.inner = std::move(inner);
  phantom.fragments.push_back({});
  phantom.fragments[0].name = "whole";
  return phantom;
}

/// The standard geometry: source on -y for beta 0, detector 1000 mm away, isocentre at 600 mm.
inline Camera camera(double beta_deg = 0, int size_px = 512) { return shapes::c_arm(-beta_deg, size_px); }

}  // namespace marrow::phantom::test
