// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the triangles of a surface say about its inside.
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "marrow/domain/mesh.hpp"

namespace marrow::exchange {

/// The edges of a surface that has no certain inside, and the parts of one that has.
struct SurfaceShape {
  std::size_t open_edges = 0;      ///< of one triangle
  std::size_t crowded_edges = 0;   ///< of more than two triangles
  std::size_t contrary_edges = 0;  ///< of two triangles that face different sides
  std::vector<std::uint32_t> part_of_triangle;
  std::vector<double> part_volumes_mm3;  ///< negative where the triangles face inwards; without a meaning if not closed
  bool is_closed() const { return open_edges + crowded_edges + contrary_edges == 0; }
};

/// Parts are triangles that hang together by their edges. The mesh must satisfy check_mesh().
SurfaceShape shape_of(const Mesh& mesh);

/// The parts that face inwards and lie in no part that faces outwards. Others that face inwards are cavities. The
/// surface must be closed. Only the largest 50 parts that face inwards are looked at.
std::vector<std::uint32_t> parts_inside_out(const Mesh& mesh, const SurfaceShape& shape);

/// The place where two triangles without a common corner cross. `is_whole`: all pairs have been compared; a surface of
/// very many long triangles may need too many comparisons.
struct Crossing {
  std::optional<Eigen::Vector3d> place_mm;
  bool is_whole = true;
};
Crossing crossing_of(const Mesh& mesh);

}  // namespace marrow::exchange
