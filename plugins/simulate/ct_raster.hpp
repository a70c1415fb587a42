// SPDX-License-Identifier: Apache-2.0
#pragma once
// The fine raster on which a CT is drawn, and the point-spread function that turns it into voxels.
#include <array>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::phantom {

/// All x, y with x0 <= x < x1 and y0 <= y < y1. Empty if x0 >= x1.
struct Rectangle {
  int x0, x1, y0, y1;
};

/// The fine raster of a grid. Along y and z it consists of rays, along x of bins that take exact lengths.
struct Raster {
  /// `blur_mm`: standard deviation of the Gaussian point-spread function. A slice is averaged over its thickness.
  Raster(const Grid& grid, double blur_mm, double slice_thickness_mm);

  /// Blurs a fine plane in x and y and samples it at the grid's positions. The plane must be zero outside `bone`.
  /// Returns the part of `blurred` that is set.
  Rectangle blur(const std::vector<double>& plane, const Rectangle& bone, std::vector<double>& blurred) const;

  std::array<int, 3> voxels;  ///< size of the grid
  std::array<int, 3> steps;   ///< fine samples per voxel
  std::array<int, 3> halo;    ///< fine samples beyond the grid on each side, for the blur
  std::array<int, 3> size;
  Eigen::Vector3d spacing_mm, origin_mm;
  std::array<std::vector<double>, 3> spread;  ///< weights of the point-spread function over the halo; their sum is 1
};

}  // namespace marrow::phantom
