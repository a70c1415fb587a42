// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/phantom/loft.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "marrow/domain/transform.hpp"

namespace marrow::phantom {
namespace {

using Eigen::Vector3d;

/// The direction of a curve at one of its points.
Vector3d direction_at(const Points& curve, std::size_t i) {
  const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, curve.size() - 1);
  return (curve[after] - curve[before]).normalized();
}

}  // namespace

Mesh loft(const std::vector<Points>& rings) {
  Mesh mesh;
  mesh.frame = "world";
  const std::uint32_t sides = std::uint32_t(rings.front().size()), count = std::uint32_t(rings.size());
  Vector3d first = Vector3d::Zero(), last = first;
  for (const Points& ring : rings) mesh.vertices_mm.insert(mesh.vertices_mm.end(), ring.begin(), ring.end());
  for (std::uint32_t k = 0; k < sides; ++k) {
    first += rings.front()[k] / sides;
    last += rings.back()[k] / sides;
  }
  mesh.vertices_mm.push_back(first);
  mesh.vertices_mm.push_back(last);
  const std::uint32_t at_first = sides * count, at_last = at_first + 1, end = sides * (count - 1);
  for (std::uint32_t k = 0; k < sides; ++k) {
    const std::uint32_t next = (k + 1) % sides;
    for (std::uint32_t ring = 0; ring + 1 < count; ++ring) {
      const std::uint32_t below = ring * sides, above = below + sides;
      mesh.triangles.push_back({below + k, below + next, above + next});
      mesh.triangles.push_back({below + k, above + next, above + k});
    }
    mesh.triangles.push_back({at_first, next, k});
    mesh.triangles.push_back({at_last, end + k, end + next});
  }
  return mesh;
}

Mesh tube(const Points& curve, const std::vector<double>& radii, int sides) {
  Vector3d across = direction_at(curve, 0).unitOrthogonal();
  std::vector<Points> rings;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const Vector3d along = direction_at(curve, i);
    across = (across - along * along.dot(across)).normalized();  // turned with the curve, without twist
    const Vector3d third = along.cross(across);
    Points& ring = rings.emplace_back();
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * kPi * k / sides;
      ring.push_back(curve[i] + radii[i] * (std::cos(angle) * across + std::sin(angle) * third));
    }
  }
  return loft(rings);
}

Mesh tube(const Vector3d& from, const Vector3d& to, double radius, int sides) {
  return tube({from, to}, {radius, radius}, sides);
}

Mesh bar(const Points& curve, const Vector3d& up, double width, double thickness) {
  std::vector<Points> rings;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const Vector3d along = direction_at(curve, i), across = along.cross(up).normalized(),
                   flat = across.cross(along).normalized();
    // Flat, across and along are right-handed.
    Points& ring = rings.emplace_back();
    for (const auto& [f, a] : {std::pair(-0.5, -0.5), std::pair(0.5, -0.5), std::pair(0.5, 0.5), std::pair(-0.5, 0.5)})
      ring.push_back(curve[i] + f * thickness * flat + a * width * across);
  }
  return loft(rings);
}

}  // namespace marrow::phantom
