// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

#include "marrow/base/fields.hpp"

namespace MARROW_EXPORT marrow {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kPi = 3.14159265358979323846;
constexpr double radians(double angle_deg) { return angle_deg * kPi / 180.0; }
constexpr double degrees(double angle_rad) { return angle_rad * 180.0 / kPi; }

/// Maps a point from the source frame to the target frame: x_target = rotation * x_source + translation_mm. Variables
/// of this type are named target_from_source. A transform knows the names of both frames, and composing transforms
/// whose frames do not match throws Error.
struct RigidTransform {
  std::string target = "world";
  std::string source = "world";
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

  /// A template only so that it is compiled where it is used, not wherever this header is included.
  template <class = void>
  Eigen::Vector3d operator*(const Eigen::Vector3d& point_mm) const {
    return rotation * point_mm + translation_mm;
  }

  using fields = Fields<&RigidTransform::target, &RigidTransform::source, &RigidTransform::rotation,
                        &RigidTransform::translation_mm>;
};

/// c_from_a = c_from_b * b_from_a. Throws Error with the names of the frames if the two frames b differ.
RigidTransform operator*(const RigidTransform& c_from_b, const RigidTransform& b_from_a);

RigidTransform inverse(const RigidTransform& target_from_source);

/// Throws Error unless the rotation is orthonormal with determinant +1 (to 1e-6) and all numbers are finite. `what`
/// names the transform in the message.
void check_rigid(const RigidTransform& transform, const std::string& what);

/// Rotation by the angle |rotation_rad| about the direction of rotation_rad (exponential map of so(3)); the identity
/// for a zero vector.
Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& rotation_rad);

/// Logarithm of a rotation: axis times angle, with the angle in [0, pi].
Eigen::Vector3d vector_from_rotation(const Eigen::Matrix3d& rotation);

/// The matrix [v] with [v] w = v x w for every w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Geodesic angle between two rotations, in [0, pi].
double geodesic_angle_rad(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

}  // namespace marrow
