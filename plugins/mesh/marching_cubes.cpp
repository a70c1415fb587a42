// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <bit>
#include <cstdlib>
#include <marrow/plugin.hpp>

#include "cell_table.hpp"
#include "surface.hpp"

namespace {

using marrow::Grid;
using marrow::Mesh;
using marrow::SignedField;
using Word = std::uint64_t;

struct Options {
  bool largest_only = true;
  int smoothing = 0;
};

/// The signs of a field, one bit a voxel, with one layer of outside around it so that the surface closes at the border.
/// Each set bit of `edges` is a grid edge that the surface crosses; its vertex has the number of set bits before it.
/// Points are counted in the padded grid, and own the edges that leave them in +x, +y and +z.
class Crossings {
 public:
  explicit Crossings(const SignedField& field)
      : field_(field),
        size_{field.grid.size[0] + 2, field.grid.size[1] + 2, field.grid.size[2] + 2},
        words_((size_[0] + 63) / 64),
        bits_(std::size_t(words_) * size_[1] * size_[2], 0),
        first_(std::size_t(words_) * size_[1] * size_[2] * 3, 0) {
    tbb::parallel_for(1, size_[2] - 1, [&](int z) {
      for (int y = 1; y < size_[1] - 1; ++y) pack_row(y, z);
    });
    number_vertices();
  }

  const std::array<int, 3>& size() const { return size_; }
  int words() const { return words_; }
  std::size_t vertex_count() const { return vertex_count_; }

  Word bits(int word, int y, int z) const { return bits_[at(word, y, z)]; }
  /// The bits of the points one further in +x.
  Word shifted(int word, int y, int z) const {
    return bits(word, y, z) >> 1 | (word + 1 < words_ ? bits(word + 1, y, z) << 63 : 0);
  }
  Word edges(int axis, int word, int y, int z) const {
    if (axis == 0) return bits(word, y, z) ^ shifted(word, y, z);
    if (axis == 1) return y + 1 < size_[1] ? bits(word, y, z) ^ bits(word, y + 1, z) : 0;
    return z + 1 < size_[2] ? bits(word, y, z) ^ bits(word, y, z + 1) : 0;
  }
  std::uint32_t first_vertex(int axis, int word, int y, int z) const { return first_[3 * at(word, y, z) + axis]; }
  /// The vertex on the edge in +axis of point (x, y, z), which the surface must cross.
  std::uint32_t vertex(int axis, int x, int y, int z) const {
    const Word before = (Word(1) << (x & 63)) - 1;
    return first_vertex(axis, x >> 6, y, z) + std::uint32_t(std::popcount(edges(axis, x >> 6, y, z) & before));
  }

  /// The field, mirrored to the outside beyond its border: the surface then closes half a voxel outside the last
  /// samples.
  float value(int x, int y, int z) const {
    const auto& size = field_.grid.size;
    const int i = std::clamp(x - 1, 0, size[0] - 1), j = std::clamp(y - 1, 0, size[1] - 1),
              k = std::clamp(z - 1, 0, size[2] - 1);
    const float value = field_.at(i, j, k);
    return i == x - 1 && j == y - 1 && k == z - 1 ? value : std::abs(value);
  }

 private:
  std::size_t at(int word, int y, int z) const { return (std::size_t(z) * size_[1] + y) * words_ + word; }

  void pack_row(int y, int z) {
    const float* row = field_.values_mm.data() + field_.grid.offset(0, y - 1, z - 1);
    for (int word = 0; word < words_; ++word) {
      const int first = std::max(64 * word, 1), last = std::min(64 * word + 64, size_[0] - 1);
      Word packed = 0;
      for (int x = first; x < last; ++x) packed |= Word(row[x - 1] < 0) << (x - 64 * word);
      bits_[at(word, y, z)] = packed;
    }
  }

  void number_vertices() {
    tbb::parallel_for(0, size_[2], [&](int z) {
      for (int y = 0; y < size_[1]; ++y)
        for (int word = 0; word < words_; ++word)
          for (int axis = 0; axis < 3; ++axis)
            first_[3 * at(word, y, z) + axis] = std::uint32_t(std::popcount(edges(axis, word, y, z)));
    });
    for (std::uint32_t& entry : first_) {
      const std::uint32_t count = entry;
      entry = std::uint32_t(vertex_count_);
      vertex_count_ += count;
    }
  }

  const SignedField& field_;
  std::array<int, 3> size_;
  int words_;
  std::vector<Word> bits_;
  std::vector<std::uint32_t> first_;
  std::size_t vertex_count_ = 0;
};

/// Calls visit(x, pattern) for each cell of the row that the surface crosses; bit c of the pattern: corner c is inside.
template <class Visit>
void for_cells(const Crossings& crossings, int y, int z, const Visit& visit) {
  for (int word = 0; word < crossings.words(); ++word) {
    Word corners[8];
    Word any = 0, all = ~Word(0);
    for (int c = 0; c < 8; c += 2) {
      corners[c] = crossings.bits(word, y + (c >> 1 & 1), z + (c >> 2));
      corners[c + 1] = crossings.shifted(word, y + (c >> 1 & 1), z + (c >> 2));
      any |= corners[c] | corners[c + 1];
      all &= corners[c] & corners[c + 1];
    }
    for (Word left = any & ~all; left; left &= left - 1) {
      const int bit = std::countr_zero(left);
      unsigned pattern = 0;
      for (int c = 0; c < 8; ++c) pattern |= unsigned(corners[c] >> bit & 1) << c;
      visit(64 * word + bit, pattern);
    }
  }
}

void place_vertices(const Crossings& crossings, const Grid& grid, std::vector<Eigen::Vector3d>& vertices_mm) {
  const Eigen::Matrix3d step_mm = grid.direction * grid.spacing_mm.asDiagonal();
  tbb::parallel_for(0, crossings.size()[2], [&](int z) {
    for (int y = 0; y < crossings.size()[1]; ++y)
      for (int word = 0; word < crossings.words(); ++word)
        for (int axis = 0; axis < 3; ++axis) {
          std::uint32_t vertex = crossings.first_vertex(axis, word, y, z);
          for (Word left = crossings.edges(axis, word, y, z); left; left &= left - 1) {
            const int x = 64 * word + std::countr_zero(left);
            const double from = crossings.value(x, y, z);
            const double to = crossings.value(x + (axis == 0), y + (axis == 1), z + (axis == 2));
            Eigen::Vector3d index(x - 1, y - 1, z - 1);
            // Kept off the grid points, where several vertices would fall together and triangles lose their normal.
            index[axis] += std::clamp(from / (from - to), 1e-4, 1 - 1e-4);
            vertices_mm[vertex++] = grid.origin_mm + step_mm * index;
          }
        }
  });
}

Mesh triangulate(const SignedField& field) {
  static const marching_cubes::CellTable kTable;
  const Crossings crossings(field);
  if (crossings.vertex_count() > 0x7fffffff)
    throw marrow::Error("field: its surface has " + std::to_string(crossings.vertex_count()) +
                        " vertices, more than a mesh can index; the field is noise or the grid far too fine");
  Mesh mesh;
  mesh.frame = field.grid.frame;
  mesh.vertices_mm.resize(crossings.vertex_count());
  place_vertices(crossings, field.grid, mesh.vertices_mm);

  const int rows = crossings.size()[1] - 1, slices = crossings.size()[2] - 1;
  std::vector<std::size_t> first(std::size_t(rows) * slices + 1, 0);
  tbb::parallel_for(0, slices, [&](int z) {
    for (int y = 0; y < rows; ++y) {
      std::size_t count = 0;
      for_cells(crossings, y, z, [&](int, unsigned pattern) { count += kTable.counts[pattern]; });
      first[std::size_t(z) * rows + y + 1] = count;
    }
  });
  for (std::size_t row = 1; row < first.size(); ++row) first[row] += first[row - 1];
  mesh.triangles.resize(first.back());
  tbb::parallel_for(0, slices, [&](int z) {
    for (int y = 0; y < rows; ++y) {
      auto* triangle = mesh.triangles.data() + first[std::size_t(z) * rows + y];
      for_cells(crossings, y, z, [&](int x, unsigned pattern) {
        for (int i = 0; i < kTable.counts[pattern]; ++i, ++triangle)
          for (int k = 0; k < 3; ++k) {
            const int edge = kTable.triangles[pattern][i][k], start = marching_cubes::kEdgeStart[edge];
            (*triangle)[k] = crossings.vertex(edge / 4, x + (start & 1), y + (start >> 1 & 1), z + (start >> 2));
          }
      });
    }
  });
  return mesh;
}

Mesh marching_cubes_mesh(const SignedField& field, const Options& options) {
  surface::check_field(field);
  Mesh mesh = triangulate(field);
  if (options.largest_only) mesh = surface::largest_component(mesh);
  surface::smooth(mesh, options.smoothing);
  return mesh;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.marching_cubes", marching_cubes_mesh)
      .summary("Marching cubes (Lorensen and Cline, SIGGRAPH 1987), closed for every field")
      .in("field", "signed distance, negative inside")
      .out("mesh", "closed surface of the field's zero level, normals outward")
      .option("largest_only", &Options::largest_only,
              "keep only the part that encloses the largest volume; drops specks and inner walls")
      .option("smoothing", &Options::smoothing, "iterations of Taubin smoothing, which keeps the volume",
              marrow::at_least(0), marrow::at_most(200));
}
