// SPDX-License-Identifier: Apache-2.0
#include "volume_grid.hpp"

#include <Eigen/LU>
#include <utility>

#include "marrow/domain/decompositions.hpp"

namespace marrow::files {

Grid grid_of(const Samples& samples) {
  Grid grid;
  grid.size = samples.size;
  grid.spacing_mm = Eigen::Map<const Eigen::Vector3d>(samples.spacing_mm.data());
  grid.origin_mm = Eigen::Map<const Eigen::Vector3d>(samples.origin_mm.data());
  grid.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(samples.direction.data());
  const Eigen::Matrix3d defect = grid.direction.transpose() * grid.direction - Eigen::Matrix3d::Identity();
  if (grid.direction.allFinite() && defect.cwiseAbs().maxCoeff() < kRoundedDirection &&
      defect.cwiseAbs().maxCoeff() > 1e-12) {
    grid.direction = nearest_orthogonal(grid.direction);
  }
  return grid;
}

void flip(Volume& volume, int axis) {
  const auto [nx, ny, nz] = volume.grid.size;
  const std::array<int, 3> half{axis == 0 ? nx / 2 : nx, axis == 1 ? ny / 2 : ny, axis == 2 ? nz / 2 : nz};
  for (int z = 0; z < half[2]; ++z)
    for (int y = 0; y < half[1]; ++y)
      for (int x = 0; x < half[0]; ++x)
        std::swap(volume.values[volume.grid.offset(x, y, z)],
                  volume.values[volume.grid.offset(axis == 0 ? nx - 1 - x : x, axis == 1 ? ny - 1 - y : y,
                                                   axis == 2 ? nz - 1 - z : z)]);
}

void make_right_handed(Volume& volume) {
  Grid& grid = volume.grid;
  if (!(grid.direction.determinant() < 0)) return;
  flip(volume, 2);
  grid.origin_mm += grid.direction.col(2) * (grid.spacing_mm[2] * (grid.size[2] - 1));
  grid.direction.col(2) *= -1;
}

}  // namespace marrow::files
