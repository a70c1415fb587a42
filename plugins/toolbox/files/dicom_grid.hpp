// SPDX-License-Identifier: Apache-2.0
#pragma once
// The grid that the slices of a CT form. Those of a tilted gantry lie sheared; they are resampled to a straight grid.
#include <Eigen/Core>

#include "dicom_slices.hpp"

namespace marrow::files {

struct SliceGrid {
  Samples geometry;  ///< without bytes
  /// By how many pixels each slice is shifted against the one before, along rows and columns; zeros if they lie
  /// straight.
  Eigen::Vector2d step_px = Eigen::Vector2d::Zero();
  double tilt_deg = 0;
  /// The grid's first pixel, counted from that of the first slice: the straight grid holds all slices whole.
  Eigen::Vector2i first_px = Eigen::Vector2i::Zero();

  std::size_t slice_pixels() const { return std::size_t(geometry.size[0]) * std::size_t(geometry.size[1]); }
};

/// `slices` are sorted by position. Throws Error, beginning with `what`, if they form no grid: if one is missing, given
/// twice, unevenly spaced, or shifted otherwise than a tilted gantry shifts it.
SliceGrid grid_of_slices(const std::string& what, const std::vector<DicomSlice>& slices);

/// Puts the values of slice `k` of a tilted gantry into the volume. Between pixels they are interpolated linearly;
/// beside the slice is air.
void put_slice(const SliceGrid& grid, const std::vector<float>& slice, const std::array<int, 3>& slice_size, int k,
               float* volume);

}  // namespace marrow::files
