// SPDX-License-Identifier: Apache-2.0
#pragma once
// PCL's Poisson reconstruction, kept apart so that its headers are compiled once.
#include <array>
#include <cstdint>
#include <vector>

namespace marrow::surface {

struct OrientedPoint {
  std::array<float, 3> place, normal;
};

struct Settings {
  int depth = 8;           ///< of the octree
  float scale = 1.1f;      ///< side of the octree's cube over the points' extent
  float point_weight = 4;  ///< of the points against the normals; 0: unscreened
};

struct Surface {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Safe to call from several threads, which take turns: PCL's octree keeps its memory in static variables. Throws
/// std::exception for what PCL runs into.
Surface reconstruct(const std::vector<OrientedPoint>& points, const Settings& settings);

}  // namespace marrow::surface
