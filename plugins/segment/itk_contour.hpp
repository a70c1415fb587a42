// SPDX-License-Identifier: Apache-2.0
#pragma once
// ITK's headers include a copy of Eigen. This header hides them from code that uses another Eigen.
#include <array>
#include <vector>

namespace marrow::segment {

/// `sigma_mm`: of the Gaussian gradient of the CT. `edge_hu_per_mm`: K in speed = 1 / (1 + (gradient / K)^2).
/// `propagation`, `curvature`, `advection`: scaling of ITK's three terms. It stops after `iterations`, or when the root
/// mean square change of an iteration is below `min_rms`.
struct Settings {
  double sigma_mm, edge_hu_per_mm;
  double propagation, curvature, advection;
  int iterations;
  double min_rms;
};

struct Contour {
  std::vector<float> values;  ///< the surface is the zero level; negative inside
  int iterations = 0;
  double rms = 0;  ///< root mean square change of the last iteration
};

/// Moves the zero level of `start` (distances, negative inside) by ITK's GeodesicActiveContourLevelSetImageFilter.
/// `hu`, `start` and the result hold one value per voxel, x fastest. ITK's exceptions pass through.
Contour geodesic(const std::vector<float>& hu, std::vector<float> start, const std::array<int, 3>& size,
                 const std::array<double, 3>& spacing_mm, const Settings& settings);

}  // namespace marrow::segment
