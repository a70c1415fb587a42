// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// Signed distance up to `band_mm` to a closed surface given in the grid's frame. Beside the surface the distances are
/// exact; inside is what an odd number of crossings along z separates from the outside.
marrow::SignedField field_of_mesh(const marrow::Grid& grid, const marrow::Mesh& mesh, double band_mm);

}  // namespace marrow::field
