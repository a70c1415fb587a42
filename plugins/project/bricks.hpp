// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "attenuation.hpp"

namespace marrow::rays {

/// What attenuates, in bricks of 4 x 4 x 4 voxels, with empty ones around: a single ray finds the voxels that it needs next in the
/// memory that it has just read, whatever its direction. In rows and slices each step along the ray costs a read from far away.
class Bricks {
 public:
  explicit Bricks(const Attenuation& attenuation);

  /// Of a voxel, the sum of these is its place in values(). May be asked up to kBorder voxels beyond what attenuates.
  const std::uint32_t* offsets(int axis) const { return offsets_[std::size_t(axis)].data() - first_[std::size_t(axis)]; }
  const std::int16_t* values() const { return values_.data(); }

  static constexpr int kBorder = 4;

 private:
  std::array<int, 3> first_{0, 0, 0};  ///< the first voxel that has an offset
  std::array<std::vector<std::uint32_t>, 3> offsets_;
  std::vector<std::int16_t, LargePages<std::int16_t>> values_;
};

}  // namespace marrow::rays
