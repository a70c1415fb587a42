// SPDX-License-Identifier: Apache-2.0
#pragma once
// How exactly a camera is known, and what that means for what it shows. A camera that is off sees a bone as if the bone
// had moved, so errors of all kinds become one covariance of such motions.
#include <Eigen/Core>
#include <array>
#include <optional>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::geometry {

/// Root mean square errors of a camera, as a calibration or a person states them. Those that are not stated are absent.
struct CameraDeviations {
  std::optional<double> turn_deg;       ///< of its rotation: a third of the variance about each axis
  std::optional<double> shift_mm;       ///< of its place: a third of the variance along each axis
  std::optional<double> focal_percent;  ///< of its focal length
  std::optional<double> centre_px;      ///< of its principal point: half of the variance along each side of the image
  std::optional<double> source_mm;      ///< of the source's place along the depth

  bool is_none() const { return !turn_deg && !shift_mm && !focal_percent && !centre_px && !source_mm; }
  using fields = Fields<&CameraDeviations::turn_deg, &CameraDeviations::shift_mm, &CameraDeviations::focal_percent,
                        &CameraDeviations::centre_px, &CameraDeviations::source_mm>;
};

/// The parameters of a camera that may be off.
enum class CameraParameter {
  focal_percent,
  centre_u_px,
  centre_v_px,
  source_mm,
  turn_u_deg,
  turn_v_deg,
  turn_depth_deg,
  shift_u_mm,
  shift_v_mm,
  shift_depth_mm
};
constexpr int kCameraParameters = 10;
using CameraParameters = Eigen::Matrix<double, kCameraParameters, 1>;  ///< one number for each, in their order

/// The standard deviation of each parameter; 0 where nothing is stated.
CameraParameters deviations_of(const CameraDeviations& stated);

/// How a bone at `centre_mm` (in the world) seems to move if each parameter is one unit too small in the camera: three
/// rotations [deg] about u, v and the depth of the image, through the centre, then shifts [mm] along them. A longer
/// focal length shows the bone as if it were nearer. A shift of the principal point turns the bone about the source, by
/// the same angle as the ray: the bone is seen from the same side, elsewhere. Both hold for small errors. Throws Error
/// unless the centre is in front of the camera.
Eigen::Matrix<double, 6, kCameraParameters> motion_by_parameters(const Camera& camera,
                                                                 const Eigen::Vector3d& centre_mm);

}  // namespace marrow::geometry

MARROW_VALUE_TYPE(marrow::geometry::CameraDeviations, "camera_deviations", 1)
