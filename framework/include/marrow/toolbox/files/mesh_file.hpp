// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/mesh.hpp"

namespace marrow::files {

/// Reads a triangle surface from STL (text or binary) or PLY (text or binary in either byte order). Vertices with equal
/// coordinates are merged. Triangles with two equal corners are left out. Coordinates are multiplied by `scale`, which
/// must make them mm. Throws Error for another extension, a damaged file, or a mesh that check_mesh() refuses.
Mesh read_mesh_file(const std::filesystem::path& path, double scale);

}  // namespace marrow::files
