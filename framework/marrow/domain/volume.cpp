// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/volume.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow {
namespace {

constexpr double kFinest_mm = 0.001, kCoarsest_mm = 100, kFarthestOrigin_mm = 1e6;

}  // namespace

float sample_trilinear(const Grid& grid, const std::vector<float>& values, const Eigen::Vector3d& index) {
  int base[3];
  float fraction[3];
  for (int k = 0; k < 3; ++k) {
    const double clamped = std::clamp(index[k], 0.0, double(grid.size[k] - 1));
    base[k] = std::min(int(clamped), std::max(0, grid.size[k] - 2));
    fraction[k] = float(clamped - base[k]);
  }
  const std::size_t step_x = grid.size[0] > 1 ? 1 : 0;
  const std::size_t step_y = grid.size[1] > 1 ? std::size_t(grid.size[0]) : 0;
  const std::size_t step_z = grid.size[2] > 1 ? std::size_t(grid.size[0]) * grid.size[1] : 0;
  const float* v = values.data() + grid.offset(base[0], base[1], base[2]);
  const auto along_x = [&](std::size_t at) { return v[at] + fraction[0] * (v[at + step_x] - v[at]); };
  const auto along_y = [&](std::size_t at) {
    const float first = along_x(at);
    return first + fraction[1] * (along_x(at + step_y) - first);
  };
  const float first = along_y(0);
  return first + fraction[2] * (along_y(step_z) - first);
}

void check_volume(const Volume& volume, const std::string& what) {
  const Grid& grid = volume.grid;
  for (int k = 0; k < 3; ++k) {
    if (grid.size[k] <= 0)
      throw Error(
          formatted("{}: the volume is empty (size {} x {} x {})", what, grid.size[0], grid.size[1], grid.size[2]));
    if (!(grid.spacing_mm[k] > 0) || !std::isfinite(grid.spacing_mm[k]))
      throw Error(formatted("{}: voxel spacing {:f} mm is not a positive length", what, grid.spacing_mm[k]));
    if (grid.spacing_mm[k] < kFinest_mm || grid.spacing_mm[k] > kCoarsest_mm)
      throw Error(formatted("{}: voxel spacing {:.6g} mm; expected {:.6g} to {:.6g} mm: is it in another unit?", what,
                            grid.spacing_mm[k], kFinest_mm, kCoarsest_mm));
  }
  if (volume.values.size() != grid.count())
    throw Error(formatted("{}: {} voxels expected from its size, got {}", what, grid.count(), volume.values.size()));
  if (grid.origin_mm.cwiseAbs().maxCoeff() > kFarthestOrigin_mm)
    throw Error(formatted("{}: the volume begins {:.6g} mm from the origin; expected at most 1 km", what,
                          grid.origin_mm.cwiseAbs().maxCoeff()));
  check_rigid({grid.frame, "grid", grid.direction, grid.origin_mm}, what);
  const auto bad = std::find_if(volume.values.begin(), volume.values.end(), [](float v) { return !std::isfinite(v); });
  if (bad != volume.values.end()) {
    const std::size_t at = std::size_t(bad - volume.values.begin());
    const std::size_t row = std::size_t(grid.size[0]), slice = row * grid.size[1];
    throw Error(
        formatted("{}: voxel ({}, {}, {}) is not a finite number; replace NaN and infinities (with -1000 HU for air)",
                  what, at % row, at % slice / row, at / slice));
  }
}

}  // namespace marrow
