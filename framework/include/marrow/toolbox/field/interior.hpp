// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// Fills what a bone's wall encloses: marrow canal, spongy bone and pores, so that only its outer surface remains.
///
/// A voxel is enclosed when, in at least one plane through it out of a set of planes across the bone's long axis,
/// tilted by up to 45 degrees, bone surrounds it. A canal that a fracture or the CT's end opens is thus filled up to
/// the plane that fits the opening best, while grooves of the outer surface, which no such plane closes, stay open.
/// `is_bone` holds one byte a voxel; voxels of `is_other` are never filled.
void fill_interior(const marrow::Grid& grid, std::vector<std::uint8_t>& is_bone,
                   const std::vector<std::uint8_t>& is_other);

/// Turns values that are right beside their zero level into signed distances up to `band_mm`, by fast marching
/// (Sethian, PNAS 1996), and clamps them beyond. Values beside the zero level stay as they are, so the surface does not
/// move.
void march_distances(const marrow::Grid& grid, std::vector<float>& values_mm, double band_mm);

}  // namespace marrow::field
