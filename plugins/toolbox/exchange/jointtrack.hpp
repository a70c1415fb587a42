// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/exchange/cameras.hpp"

namespace marrow::exchange {

/// Whether the file begins as a calibration of JointTrack does, with JT_INTCALIB or JTA_INTCALIB. False if there is no
/// such file.
bool is_jointtrack_camera(const std::filesystem::path& path);

/// The camera in a calibration of JointTrack: the distance from the source to the detector, the place of the principal
/// point from the middle of the image (x to the right, y up), and the side of a pixel, all in mm. The source is the
/// world's origin, with OpenCV's axes: x to the right, y down, z away from the source. The file does not hold the
/// image's size. Throws Error with what is expected for a damaged file, and for a biplane calibration.
Camera read_jointtrack_camera(const std::filesystem::path& path, const ImageSize& size);

/// The same file for a camera. Throws Error if its pixels are not square or skewed, because the file cannot say so.
/// Where the camera stands is left out.
std::string jointtrack_camera(const Camera& camera, double pixel_mm);

// Its files of an implant's poses: .jts ("JT_EULER_312") and .jtak ("JTA_EULER_KINEMATICS"). Line 2 names the
// columns, then each line is a frame: x, y, z in mm, then the rotations about z, x and y. The axes of JointTrack's
// camera are x to the right, y up, z towards the source; R = Rz Rx Ry.

/// The columns of rotations, in the file's order.
inline const std::vector<std::string> kJointTrackRotations{"z_rot", "x_rot", "y_rot"};

struct JointTrackPoses {
  /// OpenCV's camera (x to the right, y down, z away from the source) from the model; none in a frame NOT_OPTIMIZED.
  std::vector<std::optional<RigidTransform>> camera_from_model;
  /// A sentence for each column whose numbers look like the other unit.
  std::vector<std::string> doubts;
};

/// What the file leaves open. `radians` names the columns (z_rot, x_rot, y_rot) that are in radians; the others are in
/// degrees. `y_down`: the rotations refer to OpenCV's axes, as in JTML's biplane study; the shifts never do.
struct JointTrackConvention {
  std::vector<std::string> radians;
  bool y_down = false;
};

/// Reads a file of poses. Throws Error with the line if one does not hold six numbers, or if the header is another one.
JointTrackPoses read_jointtrack_poses(const std::filesystem::path& path, const JointTrackConvention& convention);

/// The text of such a file, in degrees; `header` is its first line. A frame without a pose is NOT_OPTIMIZED.
std::string jointtrack_poses(const std::vector<std::optional<RigidTransform>>& camera_from_model,
                             const std::string& header);

}  // namespace marrow::exchange
