// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/plane_solid.hpp"

#include <algorithm>
#include <cmath>

namespace marrow::analytic {

double chord_mm(const PlaneSolid& solid, const Eigen::Vector3d& start, const Eigen::Vector3d& direction) {
  double from = 0, to = 1e9;
  for (const Eigen::Vector3d& n : solid) {
    const double s = n.dot(start), d = n.dot(direction);
    if (std::abs(d) < 1e-12) {
      if (std::abs(s) > 1) return 0;
      continue;
    }
    const double a = (-1 - s) / d, b = (1 - s) / d;
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return std::max(0.0, to - from);
}

PlaneSolid box_between(const Eigen::Vector3d& half) {
  return {Eigen::Vector3d::UnitX() / half.x(), Eigen::Vector3d::UnitY() / half.y(),
          Eigen::Vector3d::UnitZ() / half.z()};
}

PlaneSolid octahedron_between(const Eigen::Vector3d& half) {
  PlaneSolid normals;
  for (int k = 0; k < 4; ++k) normals.push_back(Eigen::Vector3d(1, k & 1 ? -1 : 1, k & 2 ? -1 : 1).cwiseQuotient(half));
  return normals;
}

Volume volume_of(const PlaneSolid& solid, const Grid& grid, double hu) {
  constexpr int kParts = 4;  // a voxel is divided into this many parts along each axis
  Volume volume{grid, {}};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        int inside = 0;
        for (int i = 0; i < kParts * kParts * kParts; ++i) {
          const int v = i / kParts % kParts, w = i / kParts / kParts;
          const Eigen::Vector3d part(i % kParts, v, w);
          const Eigen::Vector3d p = grid.point_from_index(
              Eigen::Vector3d(x, y, z) + (part + Eigen::Vector3d::Constant(0.5 - 0.5 * kParts)) / kParts);
          inside += std::all_of(solid.begin(), solid.end(),
                                [&](const Eigen::Vector3d& n) { return std::abs(n.dot(p)) <= 1; });
        }
        volume.values.push_back(float(-1000 + (hu + 1000) * inside / (kParts * kParts * kParts)));
      }
  return volume;
}

SignedField field_of(const PlaneSolid& solid, const Grid& grid) {
  SignedField field{grid, {}};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        double distance = -1e9;
        const Eigen::Vector3d p = grid.point_from_index({double(x), double(y), double(z)});
        for (const Eigen::Vector3d& n : solid) distance = std::max(distance, (std::abs(n.dot(p)) - 1) / n.norm());
        field.values_mm.push_back(float(distance));
      }
  return field;
}

}  // namespace marrow::analytic
