// SPDX-License-Identifier: Apache-2.0
#pragma once
// A tetrahedron with a corner at the origin and the others along the axes, in the formats of surfaces.
#include <algorithm>
#include <array>

#include "tests/plugins/read/files.hpp"

namespace marrow::test {

inline constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

/// How far the corners are from the origin.
using Sides = std::array<int, 3>;

inline Sides corner_of(int corner, const Sides& sides) {
  Sides at{0, 0, 0};
  if (corner > 0) at[std::size_t(corner - 1)] = sides[std::size_t(corner - 1)];
  return at;
}
inline std::string corner_text(int corner, const Sides& sides) {
  const auto [x, y, z] = corner_of(corner, sides);
  return std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z);
}

inline std::string stl_text(const std::string& name = "bone", const Sides& sides = {1, 1, 1}, int faces = 4) {
  std::string text = "solid " + name + "\n";
  for (int face = 0; face < faces; ++face) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const int corner : kFaces[face]) text += "   vertex " + corner_text(corner, sides) + "\n";
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid " + name + "\n";
}

inline std::string stl_binary(std::string header = "", const Sides& sides = {1, 1, 1}) {
  header.resize(80);
  header += number(std::uint32_t(4));
  for (const auto& face : kFaces) {
    header += std::string(12, '\0');
    for (const int corner : face)
      for (const int coordinate : corner_of(corner, sides)) header += number(float(coordinate));
    header += std::string(2, '\0');
  }
  return header;
}

inline const std::string kPlyVertices = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";

inline std::string ply_text(const std::string& comments = "comment by hand\n", const Sides& sides = {1, 1, 1}) {
  std::string text = "ply\nformat ascii 1.0\n" + comments + kPlyVertices +
                     "property uchar red\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
  for (int corner = 0; corner < 4; ++corner) text += corner_text(corner, sides) + " 255\n";
  for (const auto& [a, b, c] : kFaces)
    text += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  return text;
}

/// `is_wide`: the lengths of lists have 4 bytes.
inline std::string ply_binary(bool is_big_endian, bool is_wide = false) {
  std::string bytes = std::string("ply\nformat binary_") + (is_big_endian ? "big" : "little") + "_endian 1.0\n" +
                      kPlyVertices + "element face 4\nproperty list " + (is_wide ? "uint" : "uchar") +
                      " int vertex_index\nend_header\n";
  const auto append = [&](std::string raw) {
    if (is_big_endian) std::reverse(raw.begin(), raw.end());
    bytes += raw;
  };
  for (int corner = 0; corner < 4; ++corner)
    for (const int coordinate : corner_of(corner, {1, 1, 1})) append(number(float(coordinate)));
  for (const auto& face : kFaces) {
    append(little(3, is_wide ? 4 : 1));
    for (const int corner : face) append(number(std::int32_t(corner)));
  }
  return bytes;
}

}  // namespace marrow::test
