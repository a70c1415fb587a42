// SPDX-License-Identifier: Apache-2.0
#pragma once
// PCL's Poisson reconstruction behind a plain interface, so that its headers are compiled only once.
#include <array>
#include <cstdint>
#include <vector>

namespace marrow::surface {

struct OrientedPoint {
  std::array<float, 3> place, normal;
};

struct Settings {
  int depth = 8;           ///< of the octree
  float scale = 1.1f;      ///< side of the octree's cube divided by the extent of the points
  float point_weight = 4;  ///< weight of the points relative to the normals; 0: unscreened
};

struct Surface {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Reconstructs a surface. Vertices are in the frame and unit of the points. May be called from several threads at
/// once, but only one works at a time, because PCL's octree keeps its memory in static variables. Errors of PCL are
/// thrown as std::exception.
Surface reconstruct(const std::vector<OrientedPoint>& points, const Settings& settings);

}  // namespace marrow::surface
