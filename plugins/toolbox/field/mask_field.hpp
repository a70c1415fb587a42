// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// Signed distance in mm, up to `band_mm`, to the surface of a region that is given voxel by voxel, x fastest. The mask
/// is smoothed with a Gaussian of 0.8 voxels, which removes its stairs, and the surface is where half is left. An edge
/// with a radius of less than about two voxels is rounded. Voxels outside the grid count as outside the region.
marrow::SignedField field_of_mask(const marrow::Grid& grid, const std::vector<std::uint8_t>& inside, double band_mm);

}  // namespace marrow::field
