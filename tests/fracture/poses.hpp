// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Geometry>
#include <marrow/domain/pose.hpp>

#include "shipped.hpp"

namespace fracture_poses {

/// The proximal fragment somewhere, the distal one displaced from beside it by a motion about its own axes (degrees,
/// mm).
inline marrow::List<marrow::Pose> displaced(const marrow::Vector6d& motion_deg_mm) {
  marrow::Pose proximal, distal;
  proximal.frame.origin_mm = {5, 3, 200};
  proximal.world_from_model.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  proximal.world_from_model.translation_mm = {10, -20, 30};
  distal.frame.origin_mm = {0, 0, 50};
  distal.frame.axes = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix();
  marrow::Vector6d motion = motion_deg_mm;
  motion.head<3>() *= marrow::radians(1);
  distal.world_from_model = marrow::moved(proximal.world_from_model, distal.frame, motion);
  marrow::List<marrow::Pose> poses;
  poses.add("proximal", proximal);
  poses.add("distal", distal);
  return poses;
}

inline shipped::Inputs inputs(const marrow::List<marrow::Pose>& poses) {
  return {{"poses", shipped::list(poses, "fragment")}};
}

}  // namespace fracture_poses
