// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <span>

#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::phantom {

/// A vertex in the coordinates of a bundle of rays. Rays are at integer (u, v), and `depth` increases along a ray. The
/// map to (u, v, depth) must be right-handed and map planes to planes, for example (y, z, x) for rays along x, or (u,
/// v, -1/z) for a pinhole camera.
struct RayVertex {
  double u, v, depth;
};

/// A ray's passage through a surface. sense: +1 into it, -1 out of it.
struct Crossing {
  std::uint32_t column;
  std::uint32_t row;
  std::int32_t surface;
  std::int32_t sense;
  double depth;
};

/// A grid of rays through closed surfaces. Each ray meets each closed surface an even number of times, because the
/// tests use integers, and a ray through an edge or a corner belongs to exactly one of the triangles there.
class RayBundle {
 public:
  RayBundle(int columns, int rows);
  /// Adds a surface and returns its number, counted from 0.
  int add(const std::vector<RayVertex>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles);
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  /// All crossings in rows first to last - 1, ordered by row, column and depth. Safe to call from several threads at
  /// once.
  std::vector<Crossing> crossings(int first, int last) const;

 private:
  struct Triangle {
    std::array<std::int64_t, 3> u, v;  // fixed point
    double origin_u, origin_v, depth, depth_per_u, depth_per_v, nearest, farthest;
    std::int32_t surface, sense;
  };
  void draw(const Triangle& triangle, int first, int last, std::vector<Crossing>& crossings) const;

  int columns_, rows_, surfaces_ = 0;
  std::vector<Triangle> triangles_;
  std::vector<std::vector<std::uint32_t>> bands_;  // for each band of rows the triangles in it
};

/// Splits ordered crossings into those of single rays and calls visit(std::span<const Crossing>) for each ray.
template <class Visit>
void for_each_ray(std::span<const Crossing> crossings, Visit&& visit) {
  for (std::size_t first = 0, last; first < crossings.size(); first = last) {
    for (last = first + 1; last < crossings.size() && crossings[last].column == crossings[first].column &&
                           crossings[last].row == crossings[first].row;)
      ++last;
    visit(std::span<const Crossing>(crossings.data() + first, last - first));
  }
}

/// A part of a ray inside one fragment: in its cortical bone, or inside its inner surface.
struct Interval {
  int fragment;
  bool cortical;
  double from, to;  ///< depths of the RayBundle
};

/// A phantom in the coordinates of a bundle of rays. `place(fragment)` gives the map from the bone's frame to ray
/// coordinates.
class SolidRays {
 public:
  using Map = std::function<RayVertex(const Eigen::Vector3d&)>;
  SolidRays(const Phantom& phantom, int columns, int rows, const std::function<Map(const Fragment&)>& place);

  const RayBundle& bundle() const { return bundle_; }
  /// Constructive solid geometry on the crossings of one ray. On the fragment's side of the fracture, the inside of the
  /// outer surface is cortical outside the inner surface, and not cortical inside it. Fragments do not affect each
  /// other. `found` is replaced.
  void intervals(std::span<const Crossing> ray, std::vector<Interval>& found) const;

 private:
  RayBundle bundle_;
  std::vector<int> sides_;
};

/// A part of a ray inside a body.
struct BodyInterval {
  int body;
  double from, to;  ///< depths of the RayBundle
};

/// Bodies in the coordinates of a bundle of rays. `place(body)` gives the map from the world to ray coordinates.
class BodyRays {
 public:
  using Map = SolidRays::Map;
  BodyRays(const std::vector<const Body*>& bodies, int columns, int rows, const std::function<Map(const Body&)>& place);

  const RayBundle& bundle() const { return bundle_; }
  /// Where one ray is inside each body. Bodies do not affect each other. `found` is replaced.
  void intervals(std::span<const Crossing> ray, std::vector<BodyInterval>& found) const;

 private:
  RayBundle bundle_;
};

/// A part of a ray in something. Where layers overlap, the one with the highest rank counts.
struct Layer {
  double from, to;
  int rank;
  std::size_t index = 0;  ///< of what it is, among those of its rank
};

/// Calls visit(const Layer&, double from, double to) for each part of a ray with the layer that counts there.
template <class Visit>
void visit_layers(const std::vector<Layer>& layers, Visit&& visit) {
  std::vector<double> ends;
  for (const Layer& layer : layers) {
    ends.push_back(layer.from);
    ends.push_back(layer.to);
  }
  std::sort(ends.begin(), ends.end());
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    if (!(ends[i + 1] > ends[i])) continue;
    const Layer* highest = nullptr;
    for (const Layer& layer : layers)
      if (layer.from <= ends[i] && layer.to >= ends[i + 1] && (!highest || layer.rank > highest->rank))
        highest = &layer;
    if (highest) visit(*highest, ends[i], ends[i + 1]);
  }
}

/// The part [from, to] of a straight line inside a cylinder along z, in multiples of `direction`. Empty if from >= to.
std::pair<double, double> through_cylinder(const Eigen::Vector2d& centre_mm, double radius_mm,
                                           const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction);

}  // namespace marrow::phantom
