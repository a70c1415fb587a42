// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <marrow/plugin.hpp>

#include "marrow/mesh/cells.hpp"
#include "marrow/mesh/surface.hpp"

namespace {

using marrow::Grid, marrow::Mesh, marrow::SignedField;
using marrow::surface::Signs, marrow::surface::Word;
using Options = marrow::surface::Finish;

/// Indices of the first vertices and of the first triangle of a row of cells along x. A row owns the grid edges that
/// start at its points of lowest y and z and go in +x, +y and +z. Their vertices are numbered by axis and then along x.
struct Row {
  std::uint32_t vertex[3] = {};
  std::size_t triangle = 0;
};

/// Marching cubes in two passes: the first counts, the second writes. In the second pass, each row knows where to
/// write, so rows can be processed in any order.
class Surface {
 public:
  explicit Surface(const SignedField& field)
      : signs_(field), grid_(field.grid), rows_(std::size_t(signs_.size()[1]) * signs_.size()[2]) {
    for_rows([this](int y, int z) { count(y, z); });
    add_up();
    mesh_.frame = field.grid.frame;
    for_rows([this](int y, int z) {
      place_vertices(y, z);
      write_triangles(y, z);
    });
  }
  Mesh take() { return std::move(mesh_); }

 private:
  Row& row(int y, int z) { return rows_[std::size_t(z) * signs_.size()[1] + y]; }

  template <class Work>
  void for_rows(const Work& work) {
    tbb::parallel_for(0, signs_.size()[2] - 1, [&](int z) {
      for (int y = 0; y + 1 < signs_.size()[1]; ++y) work(y, z);
    });
  }

  void count(int y, int z) {
    Row& counts = row(y, z);
    for (int axis = 0; axis < 3; ++axis)
      for (int word = 0; word < signs_.words(); ++word)
        if (const Word edges = signs_.edges(axis, word, y, z))
          counts.vertex[axis] += std::uint32_t(std::popcount(edges));
    signs_.for_cells(y, z, [&](int, unsigned pattern) { counts.triangle += kTable.counts[pattern]; });
  }

  /// Replaces each count by the sum of all counts before it.
  void add_up() {
    std::size_t vertices = 0, triangles = 0;
    for (Row& row : rows_) {
      for (std::uint32_t& first : row.vertex) vertices += std::exchange(first, std::uint32_t(vertices));
      triangles += std::exchange(row.triangle, triangles);
    }
    marrow::surface::check_vertex_count(vertices);
    mesh_.vertices_mm.resize(vertices);
    mesh_.triangles.resize(triangles);
  }

  void place_vertices(int y, int z) {
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d* vertex = mesh_.vertices_mm.data() + row(y, z).vertex[axis];
      for (int word = 0; word < signs_.words(); ++word)
        for (Word left = signs_.edges(axis, word, y, z); left; left &= left - 1)
          *vertex++ = grid_.point_from_index(signs_.crossing(axis, 64 * word + std::countr_zero(left), y, z));
    }
  }

  void write_triangles(int y, int z) {
    auto* triangle = mesh_.triangles.data() + row(y, z).triangle;
    // The index of the next vertex on each of the cell's edges. Vertices at the cell's +x side directly follow those at
    // its -x side, because cells between two visited cells have no vertices.
    std::uint32_t vertex[12];
    for (int k = 0; k < 4; ++k) vertex[k] = row(y + (k & 1), z + (k >> 1)).vertex[0];
    for (int k = 0; k < 2; ++k) {
      vertex[4 + 2 * k] = row(y, z + k).vertex[1];
      vertex[8 + 2 * k] = row(y + k, z).vertex[2];
    }
    signs_.for_cells(y, z, [&](int, unsigned pattern) {
      const unsigned crossed = kTable.crossed[pattern];
      for (int edge = 4; edge < 12; edge += 2) vertex[edge + 1] = vertex[edge] + (crossed >> edge & 1);
      for (int i = 0; i < kTable.counts[pattern]; ++i, ++triangle)
        for (int k = 0; k < 3; ++k) (*triangle)[k] = vertex[kTable.triangles[pattern][i][k]];
      for (int edge = 0; edge < 4; ++edge) vertex[edge] += crossed >> edge & 1;
      for (int edge = 4; edge < 12; edge += 2) vertex[edge] = vertex[edge + 1];
    });
  }

  static inline const marrow::surface::TriangleTable kTable;
  Signs signs_;
  const Grid& grid_;
  std::vector<Row> rows_;
  Mesh mesh_;
};

Mesh marching_cubes(const SignedField& field, const Options& options) {
  return marrow::surface::finish(Surface(field).take(), options);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.marching_cubes", marching_cubes)
      .summary("Marching cubes (Lorensen and Cline, SIGGRAPH 1987); the surface is closed for every field")
      .in("field", "signed distance, negative inside")
      .out("mesh", "closed surface of the field's zero level, normals outward")
      .option("largest_only", &Options::largest_only, marrow::surface::kLargestOnlyHelp)
      .option("smoothing", &Options::smoothing, marrow::surface::kSmoothingHelp, marrow::at_least(0),
              marrow::at_most(200));
}
