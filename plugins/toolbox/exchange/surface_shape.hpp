// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the triangles of a surface say about its inside.
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "marrow/domain/mesh.hpp"

namespace marrow::exchange {

/// Its edges tell whether the surface has a certain inside. If it has, its parts tell which side that is.
struct SurfaceShape {
  std::size_t open_edges = 0;      ///< of one triangle
  std::size_t crowded_edges = 0;   ///< of more than two triangles
  std::size_t contrary_edges = 0;  ///< of two triangles that face different sides
  std::vector<std::uint32_t> part_of_triangle;
  std::vector<double> part_volumes_mm3;  ///< negative where the triangles face inwards; meaningless if not closed
  bool is_closed() const { return open_edges + crowded_edges + contrary_edges == 0; }
};

/// A part consists of triangles that are connected by edges. The mesh must satisfy check_mesh().
SurfaceShape shape_of(const Mesh& mesh);

/// The parts that face inwards although no part that faces outwards encloses them. Enclosed ones are cavities. The
/// surface must be closed. Only the largest 50 parts that face inwards are examined.
std::vector<std::uint32_t> parts_inside_out(const Mesh& mesh, const SurfaceShape& shape);

/// The place where two triangles without a common corner cross. `is_whole`: all pairs were compared. This can take too
/// long for a surface with very many long triangles.
struct Crossing {
  std::optional<Eigen::Vector3d> place_mm;
  bool is_whole = true;
};
Crossing crossing_of(const Mesh& mesh);

}  // namespace marrow::exchange
