// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/transform.hpp"

#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {

RigidTransform operator*(const RigidTransform& c_from_b, const RigidTransform& b_from_a) {
  if (c_from_b.source != b_from_a.target)
    throw Error("cannot compose " + c_from_b.target + "_from_" + c_from_b.source + " with " + b_from_a.target +
                "_from_" + b_from_a.source + ": the first takes points in '" + c_from_b.source +
                "', the second gives points in '" + b_from_a.target + "'");
  return {c_from_b.target, b_from_a.source, c_from_b.rotation * b_from_a.rotation,
          c_from_b.rotation * b_from_a.translation_mm + c_from_b.translation_mm};
}

RigidTransform inverse(const RigidTransform& t) {
  return {t.source, t.target, t.rotation.transpose(), -(t.rotation.transpose() * t.translation_mm)};
}

void check_rigid(const RigidTransform& t, const std::string& what) {
  if (!t.rotation.allFinite() || !t.translation_mm.allFinite())
    throw Error(what + ": the transform has a number that is not finite");
  const double defect = (t.rotation.transpose() * t.rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (defect > 1e-6 || t.rotation.determinant() < 0)
    throw Error(formatted(
        "{}: not a rotation (off orthonormal by {:f}, determinant {:f}); a rotation is orthonormal with determinant +1",
        what, defect, t.rotation.determinant()));
}

Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation_rad / angle).toRotationMatrix();
}

Eigen::Vector3d vector_from_rotation(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

double geodesic_angle_rad(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  // |a - b| = 2 sqrt(2) sin(angle / 2) is exact for small angles; the arc cosine of the trace is not.
  const double half_sine = (a - b).norm() / std::sqrt(8.0);
  return 2 * std::asin(std::min(1.0, half_sine));
}

}  // namespace marrow
