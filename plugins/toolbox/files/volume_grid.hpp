// SPDX-License-Identifier: Apache-2.0
#pragma once
// From samples as a file holds them to a volume in patient axes.
#include "marrow/domain/volume.hpp"
#include "samples.hpp"

namespace marrow::files {

/// The grid that the header gives. Directions that are rounded are made exact.
Grid grid_of(const Samples& samples);

/// Reverses the samples along an axis (0 to 2) of the grid.
void flip(Volume& volume, int axis);

/// Reverses the last axis of a left-handed grid. Then it is right-handed, and each voxel keeps its value and its
/// position.
void make_right_handed(Volume& volume);

}  // namespace marrow::files
