// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::initial {

/// The space that all views show, between 250 and 2000 mm from each source.
struct SeenSpace {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< in world coordinates
  double width_mm = 0;                     ///< of the narrowest image at the middle, along its shorter side
  double nearest_mm = 0, farthest_mm = 0;  ///< depth in the first view

  /// Throws Error if there is no view, or if no place is seen by all of them.
  static SeenSpace of(const List<View>& views);
};

/// Whether a point lies between these distances in front of the source, and projects into the image.
bool is_seen(const Camera& camera, const Eigen::Vector3d& world_mm);

/// Points of this space about `step_mm` apart, in a fixed order. They lie on rays of the first view. A single view
/// hardly tells the depth: the depths of its points grow by a seventh from one to the next.
std::vector<Eigen::Vector3d> places_in(const SeenSpace& space, const List<View>& views, double step_mm);

}  // namespace marrow::initial
