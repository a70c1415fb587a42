// SPDX-License-Identifier: Apache-2.0
// Triangles that cross: a sweep along the surface's longest axis compares those whose boxes overlap.
#include <Eigen/Geometry>
#include <algorithm>

#include "surface_shape.hpp"

namespace marrow::exchange {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr std::size_t kMostComparisons = 300'000'000;  // a second
constexpr double kRounding = 1e-6;                     // of the largest coordinate: files hold 7 digits

struct TriangleBox {
  Eigen::AlignedBox3d box;
  std::uint32_t triangle = 0;
};

Corners corners_of(const Mesh& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {mesh.vertices_mm[a], mesh.vertices_mm[b], mesh.vertices_mm[c]};
}

bool have_common_corner(const std::array<std::uint32_t, 3>& a, const std::array<std::uint32_t, 3>& b) {
  return std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end();
}

/// Where the line from `from` to `to` goes through the triangle, if both ends are farther than `least_mm` from its
/// plane.
std::optional<Vector3d> meeting(const Vector3d& from, const Vector3d& to, const Corners& t, double least_mm) {
  const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  const double before = normal.dot(from - t[0]), after = normal.dot(to - t[0]);
  if (!(std::min(before, after) < -least_mm && std::max(before, after) > least_mm)) return std::nullopt;
  const Vector3d place = from + (to - from) * (before / (before - after));
  for (std::size_t k = 0; k < 3; ++k)
    if (!(normal.dot((t[(k + 1) % 3] - t[k]).cross(place - t[k])) > 0)) return std::nullopt;
  return place;
}

std::optional<Vector3d> crossing(const Corners& a, const Corners& b, double least_mm) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (const auto place = meeting(a[k], a[(k + 1) % 3], b, least_mm)) return place;
    if (const auto place = meeting(b[k], b[(k + 1) % 3], a, least_mm)) return place;
  }
  return std::nullopt;
}

}  // namespace

Crossing crossing_of(const Mesh& mesh) {
  std::vector<TriangleBox> boxes;
  boxes.reserve(mesh.triangles.size());
  Eigen::AlignedBox3d all;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    TriangleBox one{{}, i};
    for (const Vector3d& corner : corners_of(mesh, i)) one.box.extend(corner);
    all.extend(one.box);
    boxes.push_back(one);
  }
  Eigen::Index axis = 0;
  all.sizes().maxCoeff(&axis);
  std::sort(boxes.begin(), boxes.end(), [&](const TriangleBox& a, const TriangleBox& b) {
    const double low_a = a.box.min()[axis], low_b = b.box.min()[axis];
    return low_a != low_b ? low_a < low_b : a.triangle < b.triangle;
  });
  const double least_mm = kRounding * std::max(all.min().cwiseAbs().maxCoeff(), all.max().cwiseAbs().maxCoeff());
  std::size_t comparisons = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t k = i + 1; k < boxes.size() && boxes[k].box.min()[axis] <= boxes[i].box.max()[axis]; ++k) {
      if (++comparisons > kMostComparisons) return {std::nullopt, false};
      const std::uint32_t one = boxes[i].triangle, other = boxes[k].triangle;
      if (!boxes[i].box.intersects(boxes[k].box) || have_common_corner(mesh.triangles[one], mesh.triangles[other]))
        continue;
      if (const auto place = crossing(corners_of(mesh, one), corners_of(mesh, other), least_mm)) return {place, true};
    }
  return {};
}

}  // namespace marrow::exchange
