// SPDX-License-Identifier: Apache-2.0
#pragma once
// Autoscoper's file of a trial (.cfg): which cameras, folders of frames and volumes belong together. Its description:
// "Configuration File Format" in Autoscoper's documentation, versions 1.0 to 1.2.
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::exchange {

/// A file or folder that a trial names.
struct TrialPath {
  std::filesystem::path path;  ///< a relative one starts at the trial's folder, and is joined to it here
  std::string key;             ///< as "VolumeFile"
  std::string written;         ///< as the trial has it
  int line = 0;
};

/// One bone of a trial: a multi-page TIFF with the bone alone.
struct TrialVolume {
  TrialPath file;
  Eigen::Vector3d voxel_size_mm = Eigen::Vector3d::Ones();
  std::vector<std::string> flip;  ///< axes of the grid along which the samples are reversed: x, y, z
  TrialPath mesh;                 ///< its surface in Autoscoper's coordinates of the bone; an empty path: none

  /// The name of its file without the ending: what people call the bone.
  std::string name() const { return file.path.stem().string(); }
};

/// Each camera's images are in the folder with the same index.
struct AutoscoperTrial {
  std::vector<TrialPath> cameras, frame_folders;
  std::vector<TrialVolume> volumes;
  std::vector<std::string> unknown;  ///< a remark for each line with a key that is not known; Autoscoper ignores these
};

/// Reads a trial, but none of the files that it names. Lines are a key, a space and a value; those that begin with #
/// are comments. What only concerns Autoscoper's screen and search is passed over. The n-th VoxelSize, VolumeFlip and
/// MeshFile belong to the n-th VolumeFile. Throws Error with all faults and their lines.
AutoscoperTrial read_autoscoper_trial(const std::filesystem::path& path);

/// The volume that `bone` names: by its name, or by a part of the name that no other one has. An empty `bone` stands
/// for the only volume. Throws Error with the known names, beginning with `what`, if that is none or several.
const TrialVolume& volume_of_bone(const AutoscoperTrial& trial, const std::string& bone, const std::string& what);

}  // namespace marrow::exchange
