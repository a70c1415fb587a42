// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace marrow::phantom {

/// A vertex in the coordinates of a bundle of rays. Rays are at integer (u, v), and `depth` increases along a ray. The
/// map to (u, v, depth) must be right-handed and map planes to planes, for example (y, z, x) for rays along x, or (u,
/// v, -1/z) for a pinhole camera.
struct RayVertex {
  double u, v, depth;
};

/// A ray's passage through a surface. sense: +1 into it, -1 out of it.
struct Crossing {
  std::uint32_t column;
  std::uint32_t row;
  std::int32_t surface;
  std::int32_t sense;
  double depth;
};

/// A grid of rays through closed surfaces. Each ray meets each closed surface an even number of times, because the
/// tests use integers, and a ray through an edge or a corner belongs to exactly one of the triangles there.
class RayBundle {
 public:
  RayBundle(int columns, int rows);
  /// Adds a surface and returns its number, counted from 0.
  int add(const std::vector<RayVertex>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles);
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  /// All crossings in rows first to last - 1, ordered by row, column and depth. Safe to call from several threads at
  /// once.
  std::vector<Crossing> crossings(int first, int last) const;

 private:
  struct Triangle {
    std::array<std::int64_t, 3> u, v;  // fixed point
    double origin_u, origin_v, depth, depth_per_u, depth_per_v, nearest, farthest;
    std::int32_t surface, sense;
  };
  void draw(const Triangle& triangle, int first, int last, std::vector<Crossing>& crossings) const;

  int columns_, rows_, surfaces_ = 0;
  std::vector<Triangle> triangles_;
  std::vector<std::vector<std::uint32_t>> bands_;  // for each band of rows the triangles in it
};

/// Splits ordered crossings into those of single rays and calls visit(std::span<const Crossing>) for each ray.
template <class Visit>
void for_each_ray(std::span<const Crossing> crossings, Visit&& visit) {
  for (std::size_t first = 0, last; first < crossings.size(); first = last) {
    for (last = first + 1; last < crossings.size() && crossings[last].column == crossings[first].column &&
                           crossings[last].row == crossings[first].row;)
      ++last;
    visit(std::span<const Crossing>(crossings.data() + first, last - first));
  }
}

}  // namespace marrow::phantom
