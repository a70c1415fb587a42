// SPDX-License-Identifier: Apache-2.0
#pragma once
// First poses from landmarks in views, in closed form; each is near a minimum of the reprojection error, or of no use.
#include <Eigen/Core>
#include <marrow/domain/camera.hpp>
#include <string>
#include <vector>

namespace marrow::geometry {

/// A landmark in a view.
struct Sight {
  std::string name, view;
  Eigen::Vector3d model_mm;
  Eigen::Vector2d pixel;
  const Camera* camera;
};

/// Poses world_from_model: from the landmarks that two views or more show, whose places follow from the rays; and from
/// each view that shows three or more. May be empty. Throws Error where landmarks are the mirror image of those in the
/// CT.
std::vector<RigidTransform> pose_starts(const std::vector<Sight>& sights);

}  // namespace marrow::geometry
