// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <marrow/domain/volume.hpp>
#include <vector>

namespace marrow::rays {

/// For each vertex of a mesh: whether it lies within `voxels` voxels of the faces of the CT volume, or outside. There
/// the surface ends because the scan ends, not the bone. All false if `volume` is null. Throws Error as check_lies_in()
/// does.
inline std::vector<char> vertices_at_volume_border(const Mesh& mesh, const Volume* volume, double voxels) {
  std::vector<char> at_border(mesh.vertices_mm.size(), 0);
  if (!volume) return at_border;
  const Grid& grid = volume->grid;
  check_lies_in(mesh, grid, "the mesh", "the volume");
  for (std::size_t i = 0; i < at_border.size(); ++i) {
    const Eigen::Vector3d index = grid.index_from_point(mesh.vertices_mm[i]);
    for (int axis = 0; axis < 3; ++axis)
      at_border[i] |= index[axis] < voxels || index[axis] > grid.size[axis] - 1 - voxels;
  }
  return at_border;
}

}  // namespace marrow::rays
