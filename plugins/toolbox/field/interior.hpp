// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// Fills what the wall of a bone encloses: marrow canal, spongy bone and pores. Only the outer surface remains.
///
/// The test uses planes across the bone's long axis, tilted by up to 45 degrees. A voxel is enclosed if bone surrounds
/// it in at least one plane through it. So a canal that ends at a fracture or at the end of the CT is filled up to the
/// plane that fits the opening best. Grooves of the outer surface stay open, because no such plane closes them.
/// `is_bone` and `is_other` hold one byte per voxel, x fastest. Voxels of `is_other` are never filled.
void fill_interior(const marrow::Grid& grid, std::vector<std::uint8_t>& is_bone,
                   const std::vector<std::uint8_t>& is_other);

/// Turns `values_mm` into signed distances by fast marching (Sethian, PNAS 1996), clamped to `band_mm`. The values of
/// voxels beside the zero level must already be distances. They stay as they are, so the surface does not move.
void march_distances(const marrow::Grid& grid, std::vector<float>& values_mm, double band_mm);

}  // namespace marrow::field
