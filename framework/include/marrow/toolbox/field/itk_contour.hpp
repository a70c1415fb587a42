// SPDX-License-Identifier: Apache-2.0
#pragma once
// ITK's headers bring an Eigen of their own, so they stay behind this one.
#include <array>
#include <vector>

namespace marrow::field {

struct Settings {
  double sigma_mm, edge_hu_per_mm;
  double propagation, curvature, advection;
  int iterations;
  double least_rms;
};

struct Contour {
  std::vector<float> values;  ///< around 0 at the surface, negative inside
  int iterations = 0;
  double rms = 0;  ///< mean change of the last iteration
};

/// Moves the zero level of `start` (distances, negative inside) by ITK's GeodesicActiveContourLevelSetImageFilter.
Contour geodesic(const std::vector<float>& hu, std::vector<float> start, const std::array<int, 3>& size,
                 const std::array<double, 3>& spacing_mm, const Settings& settings);

}  // namespace marrow::field
