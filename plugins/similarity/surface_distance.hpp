// SPDX-License-Identifier: Apache-2.0
#pragma once
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

}  // namespace marrow::match
