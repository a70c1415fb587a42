// SPDX-License-Identifier: Apache-2.0
#pragma once
// The triangles for each of the 256 sign patterns of a cell (Lorensen and Cline, Marching cubes, SIGGRAPH 1987). They
// are computed and not copied from that paper: its table leaves holes where two neighbours treat an ambiguous face
// differently.
//
// On each face the surface consists of directed segments. A segment goes from the edge where a walk around the face
// enters the inside to the edge where it leaves the inside. So two inside corners on a face's diagonal stay apart. This
// depends only on the four signs of the face, so both cells at the face agree, and the segments of all faces form
// closed loops. A loop is cut into triangles. No diagonal may lie in a face, because the neighbour could have the same
// one. The surface is therefore a closed manifold for every field.
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace marrow::surface {

// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge 4 * axis + k runs along `axis` from
// kEdgeStart[edge].
constexpr std::array<std::uint8_t, 12> kEdgeStart = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};

constexpr int edge_between(int corner, int other) {
  const int start = corner < other ? corner : other, axis = (corner ^ other) >> 1;  // 1, 2, 4 -> 0, 1, 2
  for (int k = 4 * axis; k < 4 * axis + 4; ++k)
    if (kEdgeStart[k] == start) return k;
  return -1;
}

// The corners of each face, counter-clockwise seen from outside the cell. Faces: -x, +x, -y, +y, -z, +z.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

/// Whether both edges belong to one face of the cell.
constexpr bool share_face(int edge, int other) {
  for (const auto& face : kFaces) {
    bool has_edge = false, has_other = false;
    for (int k = 0; k < 4; ++k) {
      const int side = edge_between(face[k], face[(k + 1) % 4]);
      has_edge |= side == edge;
      has_other |= side == other;
    }
    if (has_edge && has_other) return true;
  }
  return false;
}

using Triangle = std::array<std::uint8_t, 3>;  // the three edges of the cell with its corners

/// Cuts the part loop[first..last], closed by the base first-last, into triangles without a diagonal in a face. False
/// if this is not possible.
inline bool cut(const std::vector<int>& loop, std::size_t first, std::size_t last, std::vector<Triangle>& triangles) {
  if (last - first < 2) return true;
  for (std::size_t apex = first + 1; apex < last; ++apex) {
    const auto allowed = [&](std::size_t a, std::size_t b) { return b - a == 1 || !share_face(loop[a], loop[b]); };
    if (!allowed(first, apex) || !allowed(apex, last)) continue;
    const std::size_t before = triangles.size();
    triangles.push_back({std::uint8_t(loop[first]), std::uint8_t(loop[apex]), std::uint8_t(loop[last])});
    if (cut(loop, first, apex, triangles) && cut(loop, apex, last, triangles)) return true;
    triangles.resize(before);
  }
  return false;
}

/// The loops of edges that the surface crosses in a cell, counter-clockwise seen from outside the surface. Bit c of
/// `inside` is set if corner c is inside.
inline std::vector<std::vector<int>> cell_loops(unsigned inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kFaces)
    for (int k = 0; k < 4; ++k) {
      if ((inside >> face[k] & 1) || !(inside >> face[(k + 1) % 4] & 1)) continue;  // the walk enters on this edge
      int leave = k + 1;
      while (inside >> face[(leave + 1) % 4] & 1) ++leave;
      next[edge_between(face[k], face[(k + 1) % 4])] = edge_between(face[leave % 4], face[(leave + 1) % 4]);
    }
  std::vector<std::vector<int>> loops;
  for (int start = 0; start < 12; ++start) {
    if (next[start] < 0) continue;
    loops.emplace_back();
    for (int edge = start; next[edge] >= 0;) {
      loops.back().push_back(edge);
      edge = std::exchange(next[edge], -1);
    }
  }
  return loops;
}

inline std::vector<Triangle> cell_triangles(unsigned inside) {
  std::vector<Triangle> triangles;
  for (const std::vector<int>& loop : cell_loops(inside)) cut(loop, 0, loop.size() - 1, triangles);
  return triangles;
}

struct TriangleTable {
  static constexpr int kMost = 12;
  std::array<std::uint8_t, 256> counts{};
  std::array<std::uint16_t, 256> crossed{};  ///< bit e: the surface crosses edge e
  std::array<std::array<Triangle, kMost>, 256> triangles{};
  TriangleTable() {
    for (unsigned inside = 0; inside < 256; ++inside) {
      const std::vector<Triangle> all = cell_triangles(inside);
      counts[inside] = std::uint8_t(all.size());
      for (std::size_t i = 0; i < all.size(); ++i) {
        triangles[inside].at(i) = all[i];
        for (const int edge : all[i]) crossed[inside] |= std::uint16_t(1u << edge);
      }
    }
  }
};

}  // namespace marrow::surface
