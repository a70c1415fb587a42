// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether values that are used together lie in one place: the voxels of a field and of a volume, a surface in its CT.
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace MARROW_EXPORT marrow {

/// Throws Error unless both grids have the same frame and size, and no voxel lies farther than a hundredth of a voxel
/// from that with the same index. The message calls them the field and the volume.
void check_same_grid(const Grid& field, const Grid& volume);

/// Throws Error unless the mesh and the grid have the same frame, and at least half of the mesh's vertices lie in the
/// grid's voxels. `what` and `of` name them in the message: "the mesh", "the volume".
void check_lies_in(const Mesh& mesh, const Grid& grid, const std::string& what, const std::string& of);

}  // namespace marrow
