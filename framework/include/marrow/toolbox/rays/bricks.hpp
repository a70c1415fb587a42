// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "marrow/toolbox/rays/attenuation.hpp"

namespace marrow::rays {

/// What attenuates, in bricks of 4 x 4 x 4 voxels, with empty ones around: a single ray finds the voxels that it needs
/// next in the memory that it has just read, whatever its direction. In rows and slices each step along the ray costs a
/// read from far away.
class Bricks {
 public:
  explicit Bricks(const Attenuation& attenuation);

  /// The integral along a ray by Joseph's method (IEEE Transactions on Medical Imaging 1982), in mm of water: bilinear
  /// values slice by slice across the axis that the ray runs along most, times the path between. Source and direction
  /// in fractional voxel indices.
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const;

 private:
  static constexpr int kBorder = 4;  ///< voxels beyond what attenuates that may be asked for
  /// Of a voxel, the sum of these is its place in values_.
  const std::uint32_t* offsets(int axis) const {
    return offsets_[std::size_t(axis)].data() - begin_[std::size_t(axis)];
  }

  std::array<int, 3> first_, last_;    ///< box of what attenuates
  std::array<int, 3> begin_{0, 0, 0};  ///< the first voxel that has an offset
  Eigen::Vector3d spacing_mm_;
  std::array<std::vector<std::uint32_t>, 3> offsets_;
  std::vector<std::int16_t, LargePages<std::int16_t>> values_;
};

}  // namespace marrow::rays
