// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the edge of a body of metal appears. Right inside its outline the path through it is short, so a rim of it
// lets radiation pass, and the edge of the image lies inside the outline: the farther, the more slowly the path grows
// there and the less opaque the metal is. So a thin plate that is seen at a slant looks smaller than it is.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "marrow/domain/functions.hpp"

namespace marrow::deviations {

/// The lengths of the rays' paths through a closed surface, in mm, around its image.
class PathLengths {
 public:
  PathLengths(const Mesh& mesh, const Camera& camera, const RigidTransform& world_from_model);
  /// Bilinear between pixels; 0 outside of the surface's image.
  double at(double u_px, double v_px) const;

 private:
  double u_px_ = 0, v_px_ = 0;  ///< of the first pixel
  cv::Mat1f lengths_mm_;        ///< kPerPixel values a pixel along each side
};

/// How metal and image blur an edge.
struct Rim {
  double opaque_mm;  ///< the path through the metal behind which 1 / e of the radiation arrives
  double blur_px;    ///< standard deviation of the blur by the device and the edge extractor together
};

constexpr int kPerPixel = 2;
constexpr double kMostInside_px = 8, kStep_px = 0.25;

/// A corner of a triangle in the grid, with the reciprocal of its depth, which is linear in the image.
struct Corner {
  double x, y, per_mm;
};

/// Calls `put(column, row, depth_mm)` for the points of the grid inside a triangle. The points on a border that two
/// triangles share belong to one of them.
template <class Put>
void fill(const std::array<Corner, 3>& corners, int columns, int rows, const Put& put) {
  const auto& [a, b, c] = corners;
  const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (area == 0 || !std::isfinite(area)) return;
  const int first = int(std::ceil(std::max(0.0, std::min({a.y, b.y, c.y})))),
            last = int(std::ceil(std::min(double(rows), std::max({a.y, b.y, c.y})))) - 1;
  for (int row = first; row <= last; ++row) {
    double left = columns, right = -1;
    for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      if ((p.y <= row) == (q.y <= row)) continue;
      const double x = p.x + (row - p.y) / (q.y - p.y) * (q.x - p.x);
      left = std::min(left, x), right = std::max(right, x);
    }
    const int from = int(std::ceil(std::max(0.0, left))), to = int(std::ceil(std::min(double(columns), right)));
    for (int column = from; column < to; ++column) {
      const double of_b = ((column - a.x) * (c.y - a.y) - (c.x - a.x) * (row - a.y)) / area,
                   of_c = ((b.x - a.x) * (row - a.y) - (column - a.x) * (b.y - a.y)) / area;
      put(column, row, 1 / (a.per_mm + of_b * (b.per_mm - a.per_mm) + of_c * (c.per_mm - a.per_mm)));
    }
  }
}

/// How far inside a point of the outline the image is steepest, in pixels: radiation exp(-path / opaque_mm), blurred,
/// along the point's normal. Between 0 and 8.
inline double edge_inside_px(const PathLengths& paths, const OutlinePoint& point, const Rim& rim) {
  // The radiation from far outside to far inside; outside of the outline it is 1, or what another part of the body
  // lets pass, which is the same on both sides of the border and so counts as 1.
  const double margin_px = 4 * rim.blur_px;
  const int count = int((kMostInside_px + 2 * margin_px) / kStep_px), first = int(margin_px / kStep_px);
  const auto path_mm = [&](double inside_px) {
    return paths.at(double(point.u_px) - inside_px * double(point.normal_u),
                    double(point.v_px) - inside_px * double(point.normal_v));
  };
  const double beside_mm = path_mm(-1);
  std::vector<double> radiation(std::size_t(count), 1.0);
  for (int i = first; i < count; ++i) {
    const double path = path_mm((i - first) * kStep_px) - beside_mm;
    radiation[std::size_t(i)] = std::exp(-std::max(0.0, path) / rim.opaque_mm);
  }
  double steepest = 0, at_px = 0;
  for (double inside_px = 0; inside_px <= kMostInside_px; inside_px += kStep_px) {
    double slope = 0;  // of the blurred radiation: a sum of the steps, each weighted by the blur
    for (int i = 1; i < count; ++i) {
      const double away_px = ((i - first - 0.5) * kStep_px - inside_px) / rim.blur_px;
      slope += (radiation[std::size_t(i - 1)] - radiation[std::size_t(i)]) * std::exp(-0.5 * away_px * away_px);
    }
    if (slope > steepest) steepest = slope, at_px = inside_px;
  }
  return at_px;
}

inline PathLengths::PathLengths(const Mesh& mesh, const Camera& camera, const RigidTransform& world_from_model) {
  const RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
  std::vector<Eigen::Vector3d> seen;
  Eigen::Vector2d low(camera.width_px, camera.height_px), high(0, 0);
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) {
    seen.push_back(camera_from_model * vertex);
    if (!(seen.back().z() > 1)) return;  // the body reaches the source, and has no image
    const Eigen::Vector2d pixel = (camera.intrinsics * seen.back()).hnormalized();
    low = low.cwiseMin(pixel), high = high.cwiseMax(pixel);
  }
  low = low.cwiseMax(Eigen::Vector2d(0, 0)), high = high.cwiseMin(Eigen::Vector2d(camera.width_px, camera.height_px));
  if (!((high - low).minCoeff() > 0)) return;
  u_px_ = std::floor(low.x()) - 1, v_px_ = std::floor(low.y()) - 1;
  lengths_mm_ = cv::Mat1f(int(kPerPixel * (high.y() - v_px_ + 2)), int(kPerPixel * (high.x() - u_px_ + 2)), 0.0f);
  const Eigen::Matrix3d rays = camera.intrinsics.inverse();
  for (const auto& triangle : mesh.triangles) {
    std::array<Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d pixel = (camera.intrinsics * seen[triangle[k]]).hnormalized();
      corners[k] = {kPerPixel * (pixel.x() - u_px_), kPerPixel * (pixel.y() - v_px_), 1 / seen[triangle[k]].z()};
    }
    const Eigen::Vector3d a = seen[triangle[0]], normal = (seen[triangle[1]] - a).cross(seen[triangle[2]] - a);
    const double sense = normal.dot(a) < 0 ? -1 : 1;  // a ray enters where the surface faces the source
    fill(corners, lengths_mm_.cols, lengths_mm_.rows, [&](int column, int row, double depth_mm) {
      const double u = u_px_ + double(column) / kPerPixel, v = v_px_ + double(row) / kPerPixel;
      lengths_mm_(row, column) += float(sense * depth_mm * (rays * Eigen::Vector3d(u, v, 1)).norm());
    });
  }
}
inline double PathLengths::at(double u_px, double v_px) const {
  const double x = kPerPixel * (u_px - u_px_), y = kPerPixel * (v_px - v_px_);
  if (!(x >= 0 && y >= 0 && x + 1 < lengths_mm_.cols && y + 1 < lengths_mm_.rows)) return 0;
  const int column = int(x), row = int(y);
  const double right = x - column, down = y - row;
  const auto value = [&](int c, int r) { return std::max(0.0, double(lengths_mm_(r, c))); };
  return (1 - down) * ((1 - right) * value(column, row) + right * value(column + 1, row)) +
         down * ((1 - right) * value(column, row + 1) + right * value(column + 1, row + 1));
}

}  // namespace marrow::deviations
