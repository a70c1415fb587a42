// SPDX-License-Identifier: Apache-2.0
#pragma once
// The exact borders of a bone in an image, from its known surface and pose. Nodes that find borders must not use this.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/mesh.hpp>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace true_borders {

struct Borders {
  marrow::LineSegment left, right;
  double width_px = 0;        ///< distance of the borders in the middle, measured across them
  Eigen::Vector3d middle_mm;  ///< the middle of the surface's outline along the pair, in world coordinates
};

using Points = std::vector<Eigen::Vector2d>;
using Edges = std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>;

/// The edges of an outline in the image, and the middle of all their ends, relative to the source.
struct Outline {
  Edges edges;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
};

/// Coordinates in px along a pair of borders: x runs along the line midway between them, from its start; y runs to the
/// right.
struct Stretch {
  Eigen::Vector2d start, along, across;
  double length_px;

  explicit Stretch(const marrow::ShaftLines& pair)
      : start(0.5 * (pair.left.from_px + pair.right.from_px)),
        along(0.5 * (pair.left.to_px + pair.right.to_px) - start),
        length_px(along.norm()) {
    along.normalize();
    across = {-along.y(), along.x()};
  }
  Eigen::Vector2d from_pixel(const Eigen::Vector2d& pixel) const {
    return {along.dot(pixel - start), across.dot(pixel - start)};
  }
  Eigen::Vector2d to_pixel(const Eigen::Vector2d& point) const {
    return start + point.x() * along + point.y() * across;
  }
};

/// The projected edges where the surface turns away from the source or ends, in the coordinates of the stretch.
/// Triangles beyond the stretch, or not completely in front of the source, are ignored.
inline Outline outline_of(const marrow::Mesh& model, const marrow::RigidTransform& camera_from_model,
                          const Eigen::Matrix3d& intrinsics, const Stretch& stretch) {
  std::vector<Eigen::Vector3d> seen(model.vertices_mm.size());  // relative to the source
  Points flat(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    seen[i] = camera_from_model * model.vertices_mm[i];
    flat[i] = stretch.from_pixel((intrinsics * seen[i]).hnormalized());
  }
  struct Sides {
    int facing = 0, turned_away = 0;  // numbers of triangles at an edge
  };
  std::unordered_map<std::uint64_t, Sides> sides;
  for (const auto& [a, b, c] : model.triangles) {
    if (!(std::min({seen[a].z(), seen[b].z(), seen[c].z()}) > 0)) continue;
    const auto [first, last] = std::minmax({flat[a].x(), flat[b].x(), flat[c].x()});
    if (last < 0 || first > stretch.length_px) continue;
    const bool faces = seen[a].dot(seen[b].cross(seen[c])) < 0;
    for (const auto& [from, to] : {std::minmax(a, b), std::minmax(b, c), std::minmax(c, a)}) {
      Sides& edge = sides[(std::uint64_t(from) << 32) | to];
      ++(faces ? edge.facing : edge.turned_away);
    }
  }
  Outline outline;
  for (const auto& [edge, side] : sides) {
    if (side.facing + side.turned_away == 2 && side.facing != 1) continue;
    const std::size_t from = edge >> 32, to = edge & 0xffffffff;
    outline.edges.emplace_back(flat[from], flat[to]);
    outline.middle_mm += 0.5 * (seen[from] + seen[to]);
  }
  if (!outline.edges.empty()) outline.middle_mm /= double(outline.edges.size());
  return outline;
}

/// The outermost points on the left and on the right, at 0, 1, 2, ... px along the stretch, wherever there is an edge.
inline std::pair<Points, Points> outermost(const Edges& edges, const Stretch& stretch) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const std::size_t count = std::size_t(stretch.length_px) + 1;
  std::vector<double> left(count, kNone), right(count, -kNone);
  for (auto [a, b] : edges) {
    if (a.x() > b.x()) std::swap(a, b);
    for (double x = std::max(0.0, std::ceil(a.x())); x <= b.x() && x < double(count) && a.x() < b.x(); ++x) {
      const double y = a.y() + (x - a.x()) / (b.x() - a.x()) * (b.y() - a.y());
      left[std::size_t(x)] = std::min(left[std::size_t(x)], y);
      right[std::size_t(x)] = std::max(right[std::size_t(x)], y);
    }
  }
  std::pair<Points, Points> points;
  for (std::size_t i = 0; i < count; ++i) {
    if (left[i] == kNone) continue;
    points.first.emplace_back(double(i), left[i]);
    points.second.emplace_back(double(i), right[i]);
  }
  return points;
}

/// y = start + slope x [px].
struct Line {
  double start = 0, slope = 0;
  double at(double x) const { return start + slope * x; }
};

inline Line least_squares(const Points& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p / double(points.size());
  double xx = 0, xy = 0;
  for (const auto& p : points) xx += (p.x() - mean.x()) * (p.x() - mean.x()), xy += (p.x() - mean.x()) * (p - mean).y();
  return {mean.y() - xy / xx * mean.x(), xy / xx};
}

/// The least-squares line of the points. The farthest point is removed again and again until it is within the
/// tolerance.
inline Line line_of(Points points, double tolerance_px) {
  for (;;) {
    const Line line = least_squares(points);
    const auto off = [&](const Eigen::Vector2d& p) { return std::abs(p.y() - line.at(p.x())); };
    const auto farthest =
        std::max_element(points.begin(), points.end(), [&](const auto& p, const auto& q) { return off(p) < off(q); });
    if (points.size() < 3 || off(*farthest) <= tolerance_px) return line;
    points.erase(farthest);
  }
}

/// Least-squares lines of a surface's outline on both sides, along a pair of borders. The outline consists of the mesh
/// edges where the surface turns away from the X-ray source (the contour generator; Cipolla and Giblin, Visual Motion
/// of Curves and Surfaces, 2000) or ends. At every pixel along the pair, the outermost point of these edges counts. The
/// farthest point is removed until all points lie within `tolerance_mm`, at the middle of this outline, of the line;
/// this removes broken ends and the flare at a joint. Nothing if the surface appears along less than a third of the
/// pair, or along less than 10 px.
inline std::optional<Borders> borders_beside(const marrow::ShaftLines& pair, const marrow::Mesh& model,
                                             const marrow::RigidTransform& world_from_model,
                                             const marrow::Camera& camera, double tolerance_mm) {
  const Stretch stretch(pair);
  if (!(stretch.length_px >= 1)) return std::nullopt;
  const Outline outline = outline_of(model, camera.camera_from_world * world_from_model, camera.intrinsics, stretch);
  const auto [on_left, on_right] = outermost(outline.edges, stretch);
  if (on_left.size() < 10 || 3 * double(on_left.size()) < stretch.length_px) return std::nullopt;
  const Eigen::Vector3d middle_mm = inverse(camera.camera_from_world) * outline.middle_mm;
  const double tolerance_px = tolerance_mm / pixel_size_at_mm(camera, middle_mm);
  const Line left = line_of(on_left, tolerance_px), right = line_of(on_right, tolerance_px);
  const auto segment = [&](const Line& line) {
    return marrow::LineSegment{stretch.to_pixel({0, line.at(0)}),
                               stretch.to_pixel({stretch.length_px, line.at(stretch.length_px)})};
  };
  return Borders{segment(left), segment(right), right.at(stretch.length_px / 2) - left.at(stretch.length_px / 2),
                 middle_mm};
}

}  // namespace true_borders
