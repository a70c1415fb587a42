// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "marrow/project/rays.hpp"

namespace marrow::rays {

/// The voxels that attenuate, in bricks of 4 x 4 x 4 voxels, with empty voxels around them. A ray of any direction
/// finds its next voxels in memory that it has just read. With voxels in rows and slices each step along the ray would
/// read distant memory. Safe to use from several threads at once.
class Bricks {
 public:
  explicit Bricks(const Attenuation& attenuation);

  /// The line integral along a ray in mm of water, by Joseph's method (IEEE Transactions on Medical Imaging 1982): the
  /// sum of the bilinear values in each slice across the ray's main axis, times the path from slice to slice. `source`
  /// and `direction` are in fractional voxel indices.
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const;

  /// The same with its derivatives by a small motion of the model.
  RayMotion::Change change(const RayMotion& motion, const Eigen::Vector3d& direction) const;

 private:
  static constexpr int kBorder = 4;  ///< number of empty voxels around the box that may be read
  /// The slices that a ray crosses; none if begin > end.
  struct Path {
    SliceAxes axes;
    int begin = 0, end = -1;
  };
  Path path_of(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const;
  /// The place of voxel (x, y, z) in values_ is offsets(0)[x] + offsets(1)[y] + offsets(2)[z].
  const std::uint32_t* offsets(int axis) const {
    return offsets_[std::size_t(axis)].data() - begin_[std::size_t(axis)];
  }

  std::array<int, 3> first_, last_;    ///< box of the voxels that attenuate
  std::array<int, 3> begin_{0, 0, 0};  ///< the first voxel that has an offset, along each axis
  Eigen::Vector3d spacing_mm_;
  std::array<std::vector<std::uint32_t>, 3> offsets_;
  std::vector<std::int16_t, LargePages<std::int16_t>> values_;
};

}  // namespace marrow::rays
