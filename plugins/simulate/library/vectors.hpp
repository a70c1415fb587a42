// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bounds of points, and random vectors.
#include <Eigen/Geometry>
#include <vector>

#include "marrow/domain/random.hpp"

namespace marrow::phantom {

/// The smallest box along the axes that contains all points; empty if there are none.
inline Eigen::AlignedBox3d bounds_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  return box;
}

/// Three independent standard normal numbers, drawn in the order x, y, z.
inline Eigen::Vector3d normal_vector(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

/// A unit vector; all directions are equally likely.
inline Eigen::Vector3d random_direction(Random& random) { return normal_vector(random).normalized(); }

}  // namespace marrow::phantom
