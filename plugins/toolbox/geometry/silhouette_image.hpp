// SPDX-License-Identifier: Apache-2.0
#pragma once
// A surface drawn by filling its triangles, and a coarse one for its outlines.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/mesh.hpp>
#include <opencv2/core/mat.hpp>
#include <unordered_map>
#include <vector>

namespace marrow::geometry {

/// Fills the pixels whose centres lie inside the triangle with its number. A corner that is not finite: nothing.
inline void fill_triangle(int triangle, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                          cv::Mat1i& triangle_of) {
  if (!a.allFinite() || !b.allFinite() || !c.allFinite()) return;
  const double low = std::min({a.y(), b.y(), c.y()}), high = std::max({a.y(), b.y(), c.y()});
  const int first = int(std::ceil(std::max(low, 0.0)));
  const int last = int(std::floor(std::min(high, double(triangle_of.rows - 1))));
  for (int row = first; row <= last; ++row) {
    double left = 1e9, right = -1e9;
    for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      if ((p.y() < row && q.y() < row) || (p.y() > row && q.y() > row)) continue;
      if (p.y() == q.y()) {
        left = std::min({left, p.x(), q.x()});
        right = std::max({right, p.x(), q.x()});
      } else {
        const double u = p.x() + (row - p.y()) / (q.y() - p.y()) * (q.x() - p.x());
        left = std::min(left, u);
        right = std::max(right, u);
      }
    }
    const int from = int(std::ceil(std::max(left, 0.0))),
              to = int(std::floor(std::min(right, double(triangle_of.cols - 1))));
    int* pixels = triangle_of.ptr<int>(row);
    for (int u = from; u <= to; ++u) pixels[u] = triangle;
  }
}

/// A surface as a camera sees it: for each pixel of the camera's image the last triangle that covers its centre, or -1.
inline cv::Mat1i silhouette_image(const Mesh& mesh, const Camera& camera, const RigidTransform& world_from_model) {
  const RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
  const Eigen::Matrix3d matrix = camera.intrinsics * camera_from_model.rotation;
  const Eigen::Vector3d offset = camera.intrinsics * camera_from_model.translation_mm;
  std::vector<Eigen::Vector2d> pixels(mesh.vertices_mm.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d pixel = matrix * mesh.vertices_mm[i] + offset;
    pixels[i] = pixel.z() > 0 ? Eigen::Vector2d(pixel.hnormalized())
                              : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  cv::Mat1i triangle_of(camera.height_px, camera.width_px, -1);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    fill_triangle(int(i), pixels[t[0]], pixels[t[1]], pixels[t[2]], triangle_of);
  }
  return triangle_of;
}

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
