// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/mesh.hpp"

namespace marrow {

/// True when a mesh is closed and the triangles about each vertex form a single fan, so that no two sheets touch in a
/// point.
bool is_manifold(const Mesh& mesh);

}  // namespace marrow
