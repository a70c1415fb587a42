// SPDX-License-Identifier: Apache-2.0
#pragma once
// Autoscoper's file of a bone's poses (.tra): each line holds the 16 numbers of a frame's 4x4 matrix world from bone,
// row by row, in mm. A frame without a pose is a line of NaN, or of empty cells: commas alone.
#include <filesystem>

#include "marrow/domain/volume.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace marrow::track {

/// Skips empty lines. Throws Error if a line does not hold 16 numbers, or if they are no rigid motion. It names the
/// line, and the column of a number that cannot be read.
AutoscoperTrack read_tra_file(const std::filesystem::path& path);

/// The text of such a file, with all digits, so that the same numbers are read back.
std::string tra_text(const AutoscoperTrack& track);

/// From a volume's own coordinates to those in which Autoscoper has the same bone. It puts the corner of the volume's
/// first voxel at x = 0 and z = 0, and lets rows run against y and pages against z: a voxel's centre is at
/// ((column + 0.5) s_x, (rows - row - 0.5) s_y, -(page + 0.5) s_z), where s is the voxel size (the kernel of
/// Autoscoper's RayCaster, and its VolumeDescription). So nothing is mirrored. Flips of a trial come before this.
RigidTransform autoscoper_from_volume(const Grid& grid);

/// The pose of the volume that Autoscoper's pose of the bone means, and the other way round.
RigidTransform world_from_volume(const RigidTransform& world_from_autoscoper, const Grid& grid);
RigidTransform world_from_autoscoper(const RigidTransform& world_from_volume, const Grid& grid);

}  // namespace marrow::track
