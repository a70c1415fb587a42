// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "marrow/base/error.hpp"
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

constexpr double kNearest_mm = 250, kFarthest_mm = 2000;

inline Eigen::Vector3d at_depth(const Camera& camera, const Eigen::Vector2d& pixel, double depth_mm) {
  return inverse(camera.camera_from_world) * (camera.intrinsics.inverse() * pixel.homogeneous() * depth_mm).eval();
}

/// Whether a point lies between these distances in front of the source, and projects into the image.
inline bool is_seen(const Camera& camera, const Eigen::Vector3d& world_mm) {
  const double depth_mm = (camera.camera_from_world * world_mm).z();
  if (!(depth_mm >= kNearest_mm && depth_mm <= kFarthest_mm)) return false;
  const Eigen::Vector2d pixel = project(camera, world_mm);
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.width_px && pixel.y() < camera.height_px;
}

inline bool seen_by_all(const List<View>& views, const Eigen::Vector3d& world_mm) {
  for (const View& view : views)
    if (!is_seen(view.camera, world_mm)) return false;
  return true;
}

/// Points of this space about `step_mm` apart, in a fixed order. They lie on rays of the first view. A single view
/// hardly tells the depth: the depths of its points grow by a seventh from one to the next.
inline std::vector<Eigen::Vector3d> places_in(const SeenSpace& space, const List<View>& views, double step_mm) {
  constexpr double kDepthStep = 8.0 / 7;
  const Camera& first = views[0].camera;
  const double step_px = step_mm / pixel_size_at_mm(first, space.middle_mm);
  std::vector<Eigen::Vector3d> places_mm;
  for (double depth_mm = space.nearest_mm; depth_mm <= space.farthest_mm;
       views.size() > 1 ? depth_mm += step_mm : depth_mm *= kDepthStep)
    for (double v = 0.5 * step_px; v < first.height_px; v += step_px)
      for (double u = 0.5 * step_px; u < first.width_px; u += step_px) {
        const Eigen::Vector3d place_mm = at_depth(first, {u, v}, depth_mm);
        if (seen_by_all(views, place_mm)) places_mm.push_back(place_mm);
      }
  return places_mm;
}

inline SeenSpace SeenSpace::of(const List<View>& views) {
  if (views.empty()) throw Error("there is no view, so no place to search in; give the X-ray views");
  constexpr int kRays = 24;
  constexpr double kDepthStep = 1.02;
  const Camera& first = views[0].camera;
  SeenSpace space;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (double depth_mm = kNearest_mm; depth_mm <= kFarthest_mm; depth_mm *= kDepthStep)
    for (int row = 0; row < kRays; ++row)
      for (int column = 0; column < kRays; ++column) {
        const Eigen::Vector2d pixel((column + 0.5) * first.width_px / kRays, (row + 0.5) * first.height_px / kRays);
        const Eigen::Vector3d place_mm = at_depth(first, pixel, depth_mm);
        if (!seen_by_all(views, place_mm)) continue;
        if (weights == 0) space.nearest_mm = depth_mm;
        space.farthest_mm = depth_mm;
        // Of a single view, each doubling of the depth counts the same.
        const double weight = views.size() > 1 ? std::pow(depth_mm / kFarthest_mm, 3) : 1;
        sum += weight * place_mm;
        weights += weight;
      }
  if (weights == 0)
    throw Error(
        "no place between 250 and 2000 mm in front of the sources is seen by all views, so the bone cannot be either; "
        "see whether the cameras belong to these images and state their world in mm");
  space.middle_mm = sum / weights;
  space.width_mm = kFarthest_mm;
  for (const View& view : views)
    space.width_mm = std::min(space.width_mm, std::min(view.camera.width_px, view.camera.height_px) *
                                                  pixel_size_at_mm(view.camera, space.middle_mm));
  return space;
}

}  // namespace marrow::initial
