// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <marrow/domain/mesh.hpp>
#include <unordered_map>
#include <vector>

namespace marrow::geometry {

/// A surface with about an eighth of the triangles, for coarse outlines. All vertices within a cube of three edge
/// lengths become one (Rossignac and Borrel 1993). `at_border`: for each vertex whether the surface ends there because
/// the CT ends. A merged vertex is at the border if one of its vertices is.
struct CoarseSurface {
  Mesh mesh;
  std::vector<char> at_border;
};

inline CoarseSurface coarse_surface(const Mesh& mesh, const std::vector<char>& at_border) {
  double edges = 0;
  for (const auto& t : mesh.triangles) edges += (mesh.vertices_mm[t[0]] - mesh.vertices_mm[t[1]]).norm();
  const double side_mm = 3 * edges / double(mesh.triangles.size());
  CoarseSurface coarse;
  coarse.mesh.frame = mesh.frame;
  std::unordered_map<std::uint64_t, std::uint32_t> cubes;
  std::vector<std::uint32_t> cube_of(mesh.vertices_mm.size());
  std::vector<double> counts;
  for (std::size_t i = 0; i < cube_of.size(); ++i) {
    std::uint64_t key = 0;
    for (const double x : mesh.vertices_mm[i])
      key = key << 21 | (std::uint64_t(std::int64_t(std::floor(x / side_mm))) & 0x1fffff);
    const auto [at, is_new] = cubes.emplace(key, std::uint32_t(counts.size()));
    if (is_new) {
      coarse.mesh.vertices_mm.emplace_back(Eigen::Vector3d::Zero());
      coarse.at_border.push_back(0);
      counts.push_back(0);
    }
    cube_of[i] = at->second;
    coarse.mesh.vertices_mm[at->second] += mesh.vertices_mm[i];
    coarse.at_border[at->second] |= at_border[i];
    counts[at->second] += 1;
  }
  for (std::size_t i = 0; i < counts.size(); ++i) coarse.mesh.vertices_mm[i] /= counts[i];
  for (const auto& t : mesh.triangles) {
    const std::array<std::uint32_t, 3> triangle{cube_of[t[0]], cube_of[t[1]], cube_of[t[2]]};
    if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0])
      coarse.mesh.triangles.push_back(triangle);
  }
  return coarse;
}

}  // namespace marrow::geometry
