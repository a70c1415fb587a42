// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// CGAL's surface mesher behind a plain interface, so that its headers are compiled only once.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace marrow::delaunay {

/// A level set within a ball around the origin. `value` is negative inside and never 0.
struct LevelSet {
  std::function<double(const Eigen::Vector3d& point_mm)> value;
  double radius_mm = 0;
  std::vector<Eigen::Vector3d> points_mm;  ///< initial points on the level set; each of its parts needs some
};

struct Criteria {
  double angle_deg = 30;     ///< smallest angle of a triangle
  double size_mm = 2;        ///< largest radius of a triangle's surface Delaunay ball
  double distance_mm = 0.1;  ///< largest distance between a triangle's circumcentre and that ball's centre
  std::size_t most_points = 1000000;
};

struct Surface {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< normals outward
  bool complete = false;                                ///< false: it stopped at most_points
};

/// Meshes the level set. Calls `step` every 1000 points; `step` may throw, for example to cancel. Errors of CGAL are
/// thrown as std::exception.
Surface mesh(const LevelSet& level_set, const Criteria& criteria, const std::function<void()>& step);

}  // namespace marrow::delaunay
