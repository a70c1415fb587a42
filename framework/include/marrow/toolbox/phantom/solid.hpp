// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "marrow/toolbox/phantom/mesh_rays.hpp"
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

/// The part [from, to] of a straight line inside a cylinder along z, in multiples of `direction`. Empty if from >= to.
std::pair<double, double> through_cylinder(const Eigen::Vector2d& centre_mm, double radius_mm,
                                           const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction);

}  // namespace marrow::phantom
