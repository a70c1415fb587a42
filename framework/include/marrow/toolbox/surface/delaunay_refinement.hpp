// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// CGAL's surface mesher, kept apart so that its headers are compiled once.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace marrow::surface {

/// A level set within a ball about the origin, negative inside and never 0.
struct LevelSet {
  std::function<double(const Eigen::Vector3d& point_mm)> value;
  double radius_mm = 0;
  std::vector<Eigen::Vector3d> points_mm;  ///< on it, some on each of its parts: meshing begins with them
};

struct Criteria {
  double angle_deg = 30;     ///< smallest angle of a triangle
  double size_mm = 2;        ///< largest radius of a triangle's circle
  double distance_mm = 0.1;  ///< largest distance of a triangle's middle from the level set
  std::size_t most_points = 1000000;
};

struct Surface {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< normals outward
  bool complete = false;                                ///< false: it stopped at most_points
};

/// Calls `step` now and then; it may throw. Throws std::exception for what CGAL runs into.
Surface mesh(const LevelSet& level_set, const Criteria& criteria, const std::function<void()>& step);

}  // namespace marrow::surface
