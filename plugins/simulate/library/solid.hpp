// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "marrow/simulate/mesh_rays.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::phantom {

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
