// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/camera_deviations.hpp"

#include <cmath>

namespace marrow::geometry {

CameraParameters deviations_of(const CameraDeviations& stated) {
  const double centre = stated.centre_px.value_or(0) / std::sqrt(2.0),
               turn = stated.turn_deg.value_or(0) / std::sqrt(3.0),
               shift = stated.shift_mm.value_or(0) / std::sqrt(3.0);
  CameraParameters deviations;
  deviations << stated.focal_percent.value_or(0), centre, centre, stated.source_mm.value_or(0), turn, turn, turn, shift,
      shift, shift;
  return deviations;
}

Eigen::Matrix<double, 6, kCameraParameters> motion_by_parameters(const Camera& camera,
                                                                 const Eigen::Vector3d& centre_mm) {
  const Eigen::Vector3d seen = camera.camera_from_world * centre_mm;
  if (!(seen.z() > 0)) throw Error("the bone does not lie in front of the camera");
  Eigen::Matrix<double, 6, kCameraParameters> motion;
  motion.setZero();
  const auto column = [&](CameraParameter parameter) { return motion.col(int(parameter)); };
  column(CameraParameter::focal_percent)[5] = -0.01 * seen.z();
  const Eigen::Vector3d by_u = Eigen::Vector3d::UnitY() / camera.intrinsics(0, 0),
                        by_v = -Eigen::Vector3d::UnitX() / camera.intrinsics(1, 1);
  column(CameraParameter::centre_u_px) << degrees(1) * by_u, by_u.cross(seen);
  column(CameraParameter::centre_v_px) << degrees(1) * by_v, by_v.cross(seen);
  column(CameraParameter::source_mm)[5] = 1;
  motion.rightCols<6>().setIdentity();
  return motion;
}

}  // namespace marrow::geometry
