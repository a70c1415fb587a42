// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks that values that are used together are in the same place: a field and its volume, a surface and its CT.
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace MARROW_EXPORT marrow {

/// Throws Error unless both grids have the same frame and size, and voxels of the same index are at most a hundredth of
/// a voxel apart. The message calls the grids the field and the volume.
void check_same_grid(const Grid& field, const Grid& volume);

/// Throws Error unless mesh and grid have the same frame, and at least half of the vertices are inside the grid. `what`
/// and `of` name them in the message: "the mesh", "the volume".
void check_lies_in(const Mesh& mesh, const Grid& grid, const std::string& what, const std::string& of);

}  // namespace marrow
