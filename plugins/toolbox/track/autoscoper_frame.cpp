// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/track/autoscoper_frame.hpp"

namespace marrow::track {
namespace {

constexpr const char* kFrame = "autoscoper";

}  // namespace

RigidTransform autoscoper_from_volume(const Grid& grid) {
  const Eigen::Vector3d half = grid.spacing_mm / 2;
  const Eigen::Vector3d first_mm(half.x(), grid.size[1] * grid.spacing_mm.y() - half.y(), -half.z());
  RigidTransform transform{kFrame, grid.frame};
  transform.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal() * grid.direction.transpose();
  transform.translation_mm = first_mm - transform.rotation * grid.origin_mm;
  return transform;
}

RigidTransform world_from_volume(const RigidTransform& world_from_autoscoper, const Grid& grid) {
  RigidTransform pose = world_from_autoscoper;
  pose.source = kFrame;
  return pose * autoscoper_from_volume(grid);
}

RigidTransform world_from_autoscoper(const RigidTransform& world_from_volume, const Grid& grid) {
  RigidTransform pose = world_from_volume * inverse(autoscoper_from_volume(grid));
  pose.source = world_from_volume.source;  // a file of poses names no frames
  return pose;
}

}  // namespace marrow::track
