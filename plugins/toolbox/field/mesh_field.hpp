// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// Signed distance in mm, up to `band_mm`, to a closed surface in the grid's frame. Distances beside the surface are
/// exact. A voxel is inside if a line from it along the grid's z axis crosses the surface an odd number of times.
marrow::SignedField field_of_mesh(const marrow::Grid& grid, const marrow::Mesh& mesh, double band_mm);

}  // namespace marrow::field
