// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// About the signed distance in mm, up to `band_mm`, to a smooth surface between the voxels of a mask that are inside
/// (not 0) and those that are not. The surface separates all centres of the ones from all centres of the others, and
/// has no steps: of all functions whose signs and distances the mask allows, it is the level 0 of the one that bends
/// least (Lempitsky, Surface extraction from binary volumes with higher-order smoothness, CVPR 2010). Lengths are
/// counted in voxels for this, so voxels need not be cubes. Where the mask is cut by an end of its grid, the surface
/// ends with a flat face, half a voxel beyond the last centres. The field's grid has seven voxels more on each side.
/// The same at any number of threads. Throws Error if no voxel is inside.
SignedField field_of_mask(const Volume& mask, double band_mm);

}  // namespace marrow::field
