// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the page "Case" shows of a segmentation: its outlines in the slices of the CT.
#include <array>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::workbench {

/// How many voxels along each axis become one, so that about `most_voxels` are left; 1, 1, 1 if there are no more than
/// that.
std::array<int, 3> coarse_steps(const Grid& grid, double most_voxels);

/// Means of blocks of step[0] x step[1] x step[2] voxels.
Volume coarser(const Volume& volume, const std::array<int, 3>& step);

/// The zero line of the field in a slice perpendicular to an axis of the CT's grid: both ends of each segment, in
/// indices of the CT's other two axes, the lower one first. The field's grid has the CT's axes, but may be coarser.
std::vector<float> outline_in_slice(const SignedField& field, const Grid& ct, int axis, int index);

}  // namespace marrow::workbench
