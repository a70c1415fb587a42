// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/solid.hpp"

#include <array>
#include <cmath>

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

}  // namespace marrow::phantom
