// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/mesh.hpp"

namespace marrow::files {

/// A triangle surface from STL (text or binary) or PLY (text or binary of either byte order). Equal vertices become
/// one, and triangles that have no area for it are left out. Coordinates are multiplied by `scale`. Throws Error.
Mesh read_mesh_file(const std::filesystem::path& path, double scale);

}  // namespace marrow::files
