// SPDX-License-Identifier: Apache-2.0
#include "surface_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace marrow::match {

SurfaceDistance::SurfaceDistance(const SignedField& field) : field_(field) {
  for (const float value : field.values_mm) most_ = std::max(most_, value);
  std::array<int, 3> first = field.grid.size, last{-1, -1, -1};
  for (int z = 0; z < field.grid.size[2]; ++z)
    for (int y = 0; y < field.grid.size[1]; ++y)
      for (int x = 0; x < field.grid.size[0]; ++x) {
        if (field.at(x, y, z) >= most_) continue;
        const std::array<int, 3> at{x, y, z};
        for (std::size_t k = 0; k < 3; ++k) first[k] = std::min(first[k], at[k]), last[k] = std::max(last[k], at[k]);
      }
  for (std::size_t k = 0; k < 3; ++k) {
    low_[int(k)] = std::max(0, first[k] - 1);
    high_[int(k)] = std::min(field.grid.size[k] - 1, last[k] + 1) - 1e-6;
  }
}

std::pair<double, double> SurfaceDistance::span(const Eigen::Vector3d& start, const Eigen::Vector3d& direction) const {
  if (!start.allFinite() || !direction.allFinite()) return {0, 0};
  double from = 0, to = 1e30;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(direction[k]) < 1e-12) {
      if (start[k] < low_[k] || start[k] > high_[k]) return {0, 0};
      continue;
    }
    const double a = (low_[k] - start[k]) / direction[k], b = (high_[k] - start[k]) / direction[k];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return {from, to};
}

Eigen::Vector3d SurfaceDistance::gradient(const Eigen::Vector3d& index) const {
  Eigen::Vector3d slope;
  for (int k = 0; k < 3; ++k) {
    Eigen::Vector3d low = index, high = index;
    low[k] = std::max(low_[k], index[k] - 1);
    high[k] = std::min(high_[k], index[k] + 1);
    slope[k] = double(at(high) - at(low)) / (std::max(high[k] - low[k], 1e-9) * field_.grid.spacing_mm[k]);
  }
  return field_.grid.direction * slope;
}

}  // namespace marrow::match
