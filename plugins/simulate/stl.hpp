// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/mesh.hpp"

namespace marrow::simulate {

/// A surface from an STL file, binary or ASCII. Corners at the same place become one vertex. Throws Error for a
/// missing, empty, truncated or non-STL file.
Mesh read_stl(const std::filesystem::path& path);

}  // namespace marrow::simulate
