// SPDX-License-Identifier: Apache-2.0
#pragma once
// A whole radiograph at once, slice by slice: the factorisation of Lacroute and Levoy (SIGGRAPH 1994), for rays from a
// point, which turns Joseph's sums (IEEE Transactions on Medical Imaging 1982) into runs along rows of voxels.
#include <optional>
#include <vector>

#include "marrow/toolbox/rays/rays.hpp"

namespace marrow::rays {

/// A volume laid out for sums over slices along either axis.
class Slices {
 public:
  explicit Slices(const Attenuation& attenuation);

  /// The radiograph at a grid of pixels, in mm of water. Nothing where the rays differ too much in direction, or begin
  /// within the volume: such a view has to be followed ray by ray.
  std::optional<std::vector<float>> radiograph(const Rays& rays, const PixelGrid& grid) const;

  /// What attenuates in one row of voxels: from `first` to `last`; none where last < first.
  struct Extent {
    std::int16_t first = 0, last = -1;
  };
  /// The volume with slices along one axis. Rows run along another, `rows` of them in a slice.
  struct Stack {
    std::array<int, 3> axes;  ///< along the rows, across the slices, across the rows within a slice
    const std::int16_t* values = nullptr;
    int length = 0, slices = 0, rows = 0;
    std::size_t slice_stride = 0, row_stride = 0;
    std::vector<Extent> extents;  ///< slice by slice
    int first_slice = 0, last_slice = -1;

    const Extent& extent(int slice, int row) const {
      return extents[std::size_t(slice) * std::size_t(rows) + std::size_t(row)];
    }
    const std::int16_t* row(int slice, int row) const {
      return values + std::size_t(slice) * slice_stride + std::size_t(row) * row_stride;
    }
  };

 private:
  const Attenuation& attenuation_;
  std::vector<std::int16_t, LargePages<std::int16_t>> turned_;  ///< y fastest, then x, then z
  std::array<Stack, 3> stacks_;                                 ///< by the axis across the slices
};

}  // namespace marrow::rays
