// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "marrow/domain/volume.hpp"

namespace marrow::match {

/// A signed distance, restricted to the box of all voxels whose distance is below the largest value. Refers to the
/// field, which must outlive it.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const SignedField& field);

  float most_mm() const { return most_; }
  const Grid& grid() const { return field_.grid; }

  /// The part of the line that lies inside the box and in front of its start, in units of the direction. Empty if from
  /// >= to.
  std::pair<double, double> span(const Eigen::Vector3d& start, const Eigen::Vector3d& direction) const;

  /// Trilinear value at an index inside the box.
  float at(const Eigen::Vector3d& index) const {
    const int x = int(index.x()), y = int(index.y()), z = int(index.z());
    const float u = float(index.x() - x), v = float(index.y() - y), w = float(index.z() - z);
    const std::size_t down = std::size_t(field_.grid.size[0]), back = down * std::size_t(field_.grid.size[1]);
    const float* p = field_.values_mm.data() + field_.grid.offset(x, y, z);
    const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
    const float near = mix(mix(p[0], p[1], u), mix(p[down], p[down + 1], u), v);
    const float far = mix(mix(p[back], p[back + 1], u), mix(p[back + down], p[back + down + 1], u), v);
    return mix(near, far, w);
  }

  /// The gradient in the model's frame, from differences over one voxel to each side. Unlike the exact gradient of the
  /// trilinear function, it does not jump from cell to cell.
  Eigen::Vector3d gradient(const Eigen::Vector3d& index) const;

 private:
  const SignedField& field_;
  float most_ = 0;
  Eigen::Vector3d low_, high_;
};

inline SurfaceDistance::SurfaceDistance(const SignedField& field) : field_(field) {
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
inline std::pair<double, double> SurfaceDistance::span(const Eigen::Vector3d& start,
                                                       const Eigen::Vector3d& direction) const {
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
inline Eigen::Vector3d SurfaceDistance::gradient(const Eigen::Vector3d& index) const {
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
