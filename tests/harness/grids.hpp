// SPDX-License-Identifier: Apache-2.0
#pragma once
// Volumes and fields that are formulas of the place.
#include <array>
#include <marrow/domain/volume.hpp>
#include <vector>

namespace marrow::test {

inline Grid grid_at(const std::array<int, 3>& size, const Eigen::Vector3d& origin_mm = Eigen::Vector3d::Zero(),
                    const Eigen::Vector3d& spacing_mm = Eigen::Vector3d::Ones()) {
  Grid grid;
  grid.size = size;
  grid.origin_mm = origin_mm;
  grid.spacing_mm = spacing_mm;
  return grid;
}

/// formula(index) at each voxel, in the order in which they are stored.
template <class Formula>
std::vector<float> at_each_index(const Grid& grid, const Formula& formula) {
  std::vector<float> values;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) values.push_back(float(formula(Eigen::Vector3d(x, y, z))));
  return values;
}
/// formula(point in mm) at the middle of each voxel.
template <class Formula>
Volume volume_by(const Grid& grid, const Formula& formula) {
  return {grid, at_each_index(grid, [&](const auto& index) { return formula(grid.point_from_index(index)); })};
}
template <class Formula>
SignedField field_by(const Grid& grid, const Formula& distance_mm) {
  return {grid, at_each_index(grid, [&](const auto& index) { return distance_mm(grid.point_from_index(index)); })};
}

/// The value of a volume at a place.
inline float value_at(const Volume& volume, const Eigen::Vector3d& point_mm) {
  return sample_trilinear(volume.grid, volume.values, volume.grid.index_from_point(point_mm));
}

}  // namespace marrow::test
