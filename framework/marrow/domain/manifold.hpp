// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/export.hpp"
#include "marrow/domain/mesh.hpp"

namespace MARROW_EXPORT marrow {

/// True if a mesh is closed and the triangles around each vertex form a single fan. Then no two parts of the surface
/// touch in a single point.
bool is_manifold(const Mesh& mesh);

}  // namespace marrow
