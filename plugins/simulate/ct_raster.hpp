// SPDX-License-Identifier: Apache-2.0
#pragma once
// The fine raster on which a CT is drawn, and the point-spread function that turns it into voxels.
#include <algorithm>
#include <cmath>

#include "marrow/domain/volume.hpp"

namespace marrow::phantom {

/// All x, y with x0 <= x < x1 and y0 <= y < y1. Empty if x0 >= x1.
struct Rectangle {
  int x0, x1, y0, y1;
};

/// Weights of a sampled Gaussian over the halo, or of a box of this thickness that is blurred by it. Their sum is 1.
inline std::vector<double> point_spread(double blur_mm, double thickness_mm, double spacing_mm, int halo) {
  std::vector<double> weights;
  double sum = 0;
  for (int i = -halo; i <= halo; ++i) {
    const double at = i * spacing_mm, t = blur_mm > 0 ? at / blur_mm : 0, half = 0.5 * thickness_mm;
    const auto below = [&](double x) {  // share of the Gaussian below x; without blur a step
      return blur_mm > 0 ? 0.5 * std::erfc(-x / (blur_mm * std::sqrt(2.0))) : x > 1e-9 ? 1.0 : x < -1e-9 ? 0.0 : 0.5;
    };
    weights.push_back(thickness_mm > 0 ? below(at + half) - below(at - half) : std::exp(-0.5 * t * t));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// The fine raster of a grid. Along y and z it consists of rays, along x of bins that take exact lengths.
struct Raster {
  /// `blur_mm`: standard deviation of the Gaussian point-spread function. A slice is averaged over its thickness.
  Raster(const Grid& grid, double blur_mm, double slice_thickness_mm) : voxels(grid.size) {
    constexpr double kFinestMm = 0.3;
    for (int k = 0; k < 3; ++k) {
      const std::size_t i = std::size_t(k);
      steps[i] = std::max(1, int(std::ceil(grid.spacing_mm[k] / kFinestMm)));
      spacing_mm[k] = grid.spacing_mm[k] / steps[i];
      const double reach = 4 * blur_mm + (k == 2 ? 0.5 * slice_thickness_mm : 0);
      halo[i] = int(std::ceil(reach / spacing_mm[k]));
      size[i] = (grid.size[i] - 1) * steps[i] + 1 + 2 * halo[i];
      origin_mm[k] = grid.origin_mm[k] - halo[i] * spacing_mm[k];
      spread[i] = point_spread(blur_mm, k == 2 ? slice_thickness_mm : 0, spacing_mm[k], halo[i]);
    }
  }

  /// Blurs a fine plane in x and y and samples it at the grid's positions. The plane must be zero outside `bone`.
  /// Returns the part of `blurred` that is set.
  Rectangle blur(const std::vector<double>& plane, const Rectangle& bone, std::vector<double>& blurred) const {
    const int nx = voxels[0], ny = voxels[1], sx = steps[0], sy = steps[1];
    const int hx = halo[0], hy = halo[1];
    // Position i uses the fine samples i * step to i * step + 2 * halo.
    const auto first = [](int fine, int beyond, int step) {
      return std::max(0, (fine - 2 * beyond + step - 1) / step);
    };
    const Rectangle seen{first(bone.x0, hx, sx), std::min(nx, (bone.x1 - 1) / sx + 1), first(bone.y0, hy, sy),
                         std::min(ny, (bone.y1 - 1) / sy + 1)};
    const int width = std::max(0, seen.x1 - seen.x0);
    std::vector<double> rows(std::size_t(width) * std::size_t(std::max(0, bone.y1 - bone.y0)));
    for (int y = bone.y0; y < bone.y1; ++y)
      for (int x = seen.x0; x < seen.x1; ++x) {
        const double* from = plane.data() + std::size_t(y) * std::size_t(size[0]) + std::size_t(x * sx);
        double sum = 0;
        for (double weight : spread[0]) sum += weight * *from++;
        rows[std::size_t(y - bone.y0) * std::size_t(width) + std::size_t(x - seen.x0)] = sum;
      }
    for (int y = seen.y0; y < seen.y1; ++y) {
      double* to = blurred.data() + std::size_t(y) * std::size_t(nx) + std::size_t(seen.x0);
      std::fill(to, to + width, 0.0);
      for (int fine = std::max(bone.y0, y * sy); fine < std::min(bone.y1, y * sy + 2 * hy + 1); ++fine) {
        const double weight = spread[1][std::size_t(fine - y * sy)];
        const double* from = rows.data() + std::size_t(fine - bone.y0) * std::size_t(width);
        for (int x = 0; x < width; ++x) to[x] += weight * from[x];
      }
    }
    return seen;
  }

  std::array<int, 3> voxels;  ///< size of the grid
  std::array<int, 3> steps;   ///< fine samples per voxel
  std::array<int, 3> halo;    ///< fine samples beyond the grid on each side, for the blur
  std::array<int, 3> size;
  Eigen::Vector3d spacing_mm, origin_mm;
  std::array<std::vector<double>, 3> spread;  ///< weights of the point-spread function over the halo; their sum is 1
};

}  // namespace marrow::phantom
