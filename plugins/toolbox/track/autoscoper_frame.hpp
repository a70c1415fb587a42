// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/pose.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::track {

/// From a volume's own coordinates to those in which Autoscoper has the same bone. It puts the corner of the volume's
/// first voxel at x = 0 and z = 0, and lets rows run against y and pages against z: a voxel's centre is at
/// ((column + 0.5) s_x, (rows - row - 0.5) s_y, -(page + 0.5) s_z), where s is the voxel size (the kernel of
/// Autoscoper's RayCaster, and its VolumeDescription). So nothing is mirrored. Flips of a trial come before this.
RigidTransform autoscoper_from_volume(const Grid& grid);

/// The pose of the volume that Autoscoper's pose of the bone means, and the other way round.
RigidTransform world_from_volume(const RigidTransform& world_from_autoscoper, const Grid& grid);
RigidTransform world_from_autoscoper(const RigidTransform& world_from_volume, const Grid& grid);

}  // namespace marrow::track
