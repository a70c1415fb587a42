// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/solid.hpp"

#include <cmath>
#include <tuple>

namespace marrow::phantom {
namespace {

constexpr int kSurfaces = 3;  // per fragment: outer, inner, fracture

std::vector<RayVertex> mapped(const Mesh& mesh, const SolidRays::Map& map) {
  std::vector<RayVertex> vertices;
  vertices.reserve(mesh.vertices_mm.size());
  for (const auto& vertex : mesh.vertices_mm) vertices.push_back(map(vertex));
  return vertices;
}

}  // namespace

SolidRays::SolidRays(const Phantom& phantom, int columns, int rows, const std::function<Map(const Fragment&)>& place)
    : bundle_(columns, rows) {
  for (const Fragment& fragment : phantom.fragments) {
    const Map map = place(fragment);
    for (const Mesh* mesh : {&phantom.bone.outer, &phantom.bone.inner, &phantom.fracture})
      bundle_.add(mapped(*mesh, map), mesh->triangles);
    sides_.push_back(fragment.side);
  }
}

void SolidRays::intervals(std::span<const Crossing> ray, std::vector<Interval>& found) const {
  found.clear();
  for (int fragment = 0; fragment < int(sides_.size()); ++fragment) {
    std::array<int, kSurfaces> winding{0, 0, 0};
    double from = 0;
    for (const Crossing& crossing : ray) {
      if (crossing.surface / kSurfaces != fragment) continue;
      const bool on_side =
          sides_[std::size_t(fragment)] == 0 || (sides_[std::size_t(fragment)] < 0) == (winding[2] > 0);
      if (winding[0] > 0 && on_side && crossing.depth > from)
        found.push_back({fragment, winding[1] <= 0, from, crossing.depth});
      winding[std::size_t(crossing.surface % kSurfaces)] += crossing.sense;
      from = crossing.depth;
    }
  }
}

BodyRays::BodyRays(const std::vector<const Body*>& bodies, int columns, int rows,
                   const std::function<Map(const Body&)>& place)
    : bundle_(columns, rows) {
  for (const Body* body : bodies) bundle_.add(mapped(body->surface, place(*body)), body->surface.triangles);
}

void BodyRays::intervals(std::span<const Crossing> ray, std::vector<BodyInterval>& found) const {
  found.clear();
  for (std::size_t first = 0; first < ray.size(); ++first) {
    const int body = ray[first].surface;
    bool is_first = true;
    for (std::size_t i = 0; i < first; ++i) is_first = is_first && ray[i].surface != body;
    if (!is_first) continue;
    int winding = 0;
    double from = 0;
    for (const Crossing& crossing : ray.subspan(first)) {
      if (crossing.surface != body) continue;
      if (winding > 0 && crossing.depth > from) found.push_back({body, from, crossing.depth});
      winding += crossing.sense;
      from = crossing.depth;
    }
  }
}

std::pair<double, double> through_cylinder(const Eigen::Vector2d& centre, double radius, const Eigen::Vector3d& origin,
                                           const Eigen::Vector3d& direction) {
  const Eigen::Vector2d from = origin.head<2>() - centre, along = direction.head<2>();
  const double a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - radius * radius;
  const double discriminant = b * b - a * c;
  if (!(a > 0) || !(discriminant > 0)) return {0, 0};
  const double root = std::sqrt(discriminant);
  return {(-b - root) / a, (-b + root) / a};
}

namespace {

constexpr int kBandRows = 16;
// Fixed point with steps of 1/4096 of the rays' spacing. Positions are limited to 2^17 spacings, so products of
// differences fit into 64 bits.
constexpr std::int64_t kOne = 4096;
constexpr double kFar = 131072;

std::int64_t fixed_point(double position) {
  return std::int64_t(std::llround(std::clamp(position, -kFar, kFar) * kOne));
}

/// Whether a point lies to the left of the edge a -> b (positive area). A point on the edge counts as moved by an
/// infinitesimal step along u and an even smaller one along v (Edelsbrunner and Muecke, ACM TOG 1990). So it belongs to
/// exactly one of the two triangles that share the edge.
bool is_left(std::int64_t au, std::int64_t av, std::int64_t bu, std::int64_t bv, std::int64_t u, std::int64_t v) {
  const std::int64_t area = (bu - au) * (v - av) - (bv - av) * (u - au);
  if (area != 0) return area > 0;
  if (bv != av) return bv < av;
  return bu > au;
}

std::int64_t ceil_to_ray(std::int64_t position) { return (position + kOne - 1) >> 12; }
std::int64_t floor_to_ray(std::int64_t position) { return position >> 12; }

}  // namespace

RayBundle::RayBundle(int columns, int rows)
    : columns_(columns), rows_(rows), bands_(std::size_t((rows + kBandRows - 1) / kBandRows)) {}

int RayBundle::add(const std::vector<RayVertex>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  for (const auto& corners : triangles) {
    RayVertex a = vertices[corners[0]], b = vertices[corners[1]], c = vertices[corners[2]];
    Triangle triangle;
    triangle.u = {fixed_point(a.u), fixed_point(b.u), fixed_point(c.u)};
    triangle.v = {fixed_point(a.v), fixed_point(b.v), fixed_point(c.v)};
    const auto [low_u, high_u] = std::minmax({triangle.u[0], triangle.u[1], triangle.u[2]});
    const auto [low_v, high_v] = std::minmax({triangle.v[0], triangle.v[1], triangle.v[2]});
    const std::int64_t first_row = std::max<std::int64_t>(0, ceil_to_ray(low_v));
    const std::int64_t last_row = std::min<std::int64_t>(rows_ - 1, floor_to_ray(high_v));
    if (first_row > last_row || ceil_to_ray(low_u) > floor_to_ray(high_u) || high_u < 0 ||
        low_u > (columns_ - 1) * kOne)
      continue;  // no ray within its bounds
    const std::int64_t area = (triangle.u[1] - triangle.u[0]) * (triangle.v[2] - triangle.v[0]) -
                              (triangle.v[1] - triangle.v[0]) * (triangle.u[2] - triangle.u[0]);
    if (area == 0) continue;
    // With u to the right, v down and depth away from the source, a triangle that a ray enters has a negative area.
    triangle.sense = area < 0 ? 1 : -1;
    if (area < 0) {
      std::swap(b, c);
      std::swap(triangle.u[1], triangle.u[2]);
      std::swap(triangle.v[1], triangle.v[2]);
    }
    triangle.surface = surfaces_;
    triangle.origin_u = a.u;
    triangle.origin_v = a.v;
    triangle.depth = a.depth;
    const double twice = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
    const bool flat = std::abs(twice) > 0;
    triangle.depth_per_u = flat ? ((b.depth - a.depth) * (c.v - a.v) - (c.depth - a.depth) * (b.v - a.v)) / twice : 0;
    triangle.depth_per_v = flat ? ((c.depth - a.depth) * (b.u - a.u) - (b.depth - a.depth) * (c.u - a.u)) / twice : 0;
    std::tie(triangle.nearest, triangle.farthest) = std::minmax({a.depth, b.depth, c.depth});
    for (std::int64_t band = first_row / kBandRows; band <= last_row / kBandRows; ++band)
      bands_[std::size_t(band)].push_back(std::uint32_t(triangles_.size()));
    triangles_.push_back(triangle);
  }
  return surfaces_++;
}

void RayBundle::draw(const Triangle& t, int first, int last, std::vector<Crossing>& crossings) const {
  const auto [low_u, high_u] = std::minmax({t.u[0], t.u[1], t.u[2]});
  const auto [low_v, high_v] = std::minmax({t.v[0], t.v[1], t.v[2]});
  const std::int64_t first_row = std::max<std::int64_t>(first, ceil_to_ray(low_v));
  const std::int64_t last_row = std::min<std::int64_t>(last - 1, floor_to_ray(high_v));
  const std::int64_t first_column = std::max<std::int64_t>(0, ceil_to_ray(low_u));
  const std::int64_t last_column = std::min<std::int64_t>(columns_ - 1, floor_to_ray(high_u));
  for (std::int64_t row = first_row; row <= last_row; ++row)
    for (std::int64_t column = first_column; column <= last_column; ++column) {
      const std::int64_t u = column * kOne, v = row * kOne;
      if (!is_left(t.u[0], t.v[0], t.u[1], t.v[1], u, v) || !is_left(t.u[1], t.v[1], t.u[2], t.v[2], u, v) ||
          !is_left(t.u[2], t.v[2], t.u[0], t.v[0], u, v))
        continue;
      // After rounding to fixed point a ray may lie just outside a triangle that is seen edge-on. Its depth is clamped
      // to the triangle's.
      const double depth =
          t.depth + t.depth_per_u * (double(column) - t.origin_u) + t.depth_per_v * (double(row) - t.origin_v);
      crossings.push_back(
          {std::uint32_t(column), std::uint32_t(row), t.surface, t.sense, std::clamp(depth, t.nearest, t.farthest)});
    }
}

std::vector<Crossing> RayBundle::crossings(int first, int last) const {
  std::vector<Crossing> found;
  first = std::max(first, 0);
  last = std::min(last, rows_);
  for (int band = first / kBandRows; band * kBandRows < last; ++band)
    for (std::uint32_t index : bands_[std::size_t(band)])
      draw(triangles_[index], std::max(first, band * kBandRows), std::min(last, (band + 1) * kBandRows), found);
  std::sort(found.begin(), found.end(), [](const Crossing& a, const Crossing& b) {
    return std::tie(a.row, a.column, a.depth, a.surface, a.sense) <
           std::tie(b.row, b.column, b.depth, b.surface, b.sense);
  });
  return found;
}

}  // namespace marrow::phantom
