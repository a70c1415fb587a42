// SPDX-License-Identifier: Apache-2.0
#pragma once
// Start poses from landmarks in views, in closed form. Some are near a minimum of the reprojection error, others are
// useless: refine all of them and compare.
#include <Eigen/Core>
#include <marrow/domain/camera.hpp>
#include <string>
#include <vector>

namespace marrow::initial {

/// A landmark seen in a view. The camera is that of the view and must not be null.
struct Sight {
  std::string name, view;
  Eigen::Vector3d model_mm;
  Eigen::Vector2d pixel;
  const Camera* camera;
  double deviation_px = 1;  ///< standard deviation of each coordinate of the pixel
};

/// Poses world_from_ct: one from the landmarks that two or more views show, triangulated from their rays, and several
/// from each view that shows three or more landmarks. May be empty. Throws Error if the triangulated landmarks are the
/// mirror image of those in the CT.
std::vector<RigidTransform> pose_starts(const std::vector<Sight>& sights);

}  // namespace marrow::initial
