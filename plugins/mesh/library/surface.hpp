// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the meshers: checks of the field, its signs, and the last steps on the surface.
#include <algorithm>
#include <bit>
#include <cmath>

#include "marrow/domain/volume.hpp"

namespace marrow::surface {

/// Throws Error for an empty field, missing or non-finite values, a grid that is not rigid, or a field without a
/// surface.
void check_field(const marrow::SignedField& field);
/// The two parts of check_field(), for code that visits all values anyway.
void check_grid(const marrow::SignedField& field);
void check_values(bool all_finite, bool any_inside, bool any_outside);
/// Throws Error for more vertices than a mesh can index.
void check_vertex_count(std::size_t count);

/// A field that continues beyond its grid. There it has the absolute value at the nearest border sample, so it is
/// outside. A surface that reaches the border is closed half a sample beyond it. Refers to the field, which must
/// outlive it.
class Padded {
 public:
  explicit Padded(const marrow::SignedField& field) : field_(field) {}
  float operator()(int x, int y, int z) const {
    const auto& size = field_.grid.size;
    if (field_.grid.contains(x, y, z)) return field_.at(x, y, z);
    return std::abs(
        field_.at(std::clamp(x, 0, size[0] - 1), std::clamp(y, 0, size[1] - 1), std::clamp(z, 0, size[2] - 1)));
  }

 private:
  const marrow::SignedField& field_;
};

/// The component that encloses the largest volume. (An inner wall encloses a negative volume.) Its vertices keep their
/// order.
marrow::Mesh largest_component(marrow::Mesh mesh);

/// Smoothing without shrinking: `iterations` pairs of a smoothing and an inflating step (Taubin, A signal processing
/// approach to fair surface design, SIGGRAPH 1995). Shapes longer than about 2 pi / sqrt(pass_band) edges keep their
/// size. The surface must be closed. lambda and pass_band are above 0, and pass_band is at most 1.
struct Taubin {
  int iterations = 10;
  double lambda = 0.5, pass_band = 0.1;
};
/// Throws Error unless no wave of any surface grows by more than 15 %. `what` names the mesh in the message.
void check_stable(const Taubin& taubin, const std::string& what);
void smooth(marrow::Mesh& mesh, const Taubin& taubin);

/// The last steps of each mesher: keep only the largest component, then smooth.
struct Finish {
  bool largest_only = true;
  int smoothing = 0;
};
marrow::Mesh finish(marrow::Mesh mesh, const Finish& options);
constexpr auto kLargestOnlyHelp = "keep only the part that encloses the largest volume; drops specks and inner walls";
constexpr auto kSmoothingHelp = "iterations of Taubin smoothing, which keeps the volume";

using Word = std::uint64_t;

/// The signs of a field, packed to 64 samples per word. Only the signs decide which cells have triangles. Cells that
/// the surface does not cross are skipped quickly. A bit is set if the sample is inside. One layer outside is added
/// around the grid, so that the surface is closed at the border. Coordinates refer to the padded grid: (1, 1, 1) is the
/// field's first sample. Refers to the field, which must outlive it. Safe to use from several threads.
class Signs {
 public:
  /// Throws Error for a field that check_field() refuses.
  explicit Signs(const marrow::SignedField& field);

  const std::array<int, 3>& size() const { return size_; }
  int words() const { return words_; }

  Word bits(int word, int y, int z) const { return bits_[(std::size_t(z) * size_[1] + y) * words_ + word]; }
  /// The bits of the next points in +x.
  Word shifted(int word, int y, int z) const {
    return bits(word, y, z) >> 1 | (word + 1 < words_ ? bits(word + 1, y, z) << 63 : 0);
  }
  /// Bits of the points from which the surface crosses the edge of the grid in +axis.
  Word edges(int axis, int word, int y, int z) const {
    if (axis == 0) return bits(word, y, z) ^ shifted(word, y, z);
    if (axis == 1) return y + 1 < size_[1] ? bits(word, y, z) ^ bits(word, y + 1, z) : 0;
    return z + 1 < size_[2] ? bits(word, y, z) ^ bits(word, y, z + 1) : 0;
  }

  /// Sign pattern of the cell with first point (x, y, z). Bit c: the corner at (c & 1, c >> 1 & 1, c >> 2) is inside.
  unsigned pattern(int x, int y, int z) const {
    unsigned pattern = 0;
    for (int c = 0; c < 8; ++c) {
      const int at = x + (c & 1);
      pattern |= unsigned(bits(at >> 6, y + (c >> 1 & 1), z + (c >> 2)) >> (at & 63) & 1) << c;
    }
    return pattern;
  }
  /// Calls visit(x, pattern) for each cell of a row that the surface crosses, with ascending x.
  template <class Visit>
  void for_cells(int y, int z, const Visit& visit) const {
    for (int word = 0; word < words_; ++word) {
      const Word rows[4] = {bits(word, y, z), bits(word, y + 1, z), bits(word, y, z + 1), bits(word, y + 1, z + 1)};
      Word corners[8], any = 0, all = ~Word(0);
      for (int row = 0; row < 4; ++row) {
        corners[2 * row] = rows[row];
        corners[2 * row + 1] = shifted(word, y + (row & 1), z + (row >> 1));
        any |= corners[2 * row] | corners[2 * row + 1];
        all &= corners[2 * row] & corners[2 * row + 1];
      }
      for (Word left = any & ~all; left; left &= left - 1) {
        const int bit = std::countr_zero(left);
        unsigned pattern = 0;
        for (int c = 0; c < 8; ++c) pattern |= unsigned(corners[c] >> bit & 1) << c;
        visit(64 * word + bit, pattern);
      }
    }
  }

  /// Calls visit(axis, x, y, z) for each edge of the grid that the surface crosses, always in the same order.
  template <class Visit>
  void for_edges(const Visit& visit) const {
    for (int z = 0; z < size_[2]; ++z)
      for (int y = 0; y < size_[1]; ++y)
        for (int word = 0; word < words_; ++word)
          for (int axis = 0; axis < 3; ++axis)
            for (Word left = edges(axis, word, y, z); left; left &= left - 1)
              visit(axis, 64 * word + std::countr_zero(left), y, z);
  }

  /// The point where the surface crosses the edge from a point in +axis, as a fractional index of the field.
  Eigen::Vector3d crossing(int axis, int x, int y, int z) const {
    const double from = padded_(x - 1, y - 1, z - 1);
    const double to = padded_(x - 1 + (axis == 0), y - 1 + (axis == 1), z - 1 + (axis == 2));
    Eigen::Vector3d index(x - 1, y - 1, z - 1);
    // Not exactly on a grid point: there several vertices would coincide, and triangles would have no normal.
    index[axis] += std::clamp(from / (from - to), 1e-4, 1 - 1e-4);
    return index;
  }

 private:
  Padded padded_;
  std::array<int, 3> size_;
  int words_;
  std::vector<Word> bits_;
};

}  // namespace marrow::surface
