// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

#include "marrow/domain/functions.hpp"

namespace marrow::search {

/// Right Jacobian J of a rotation vector: R(r + dr) = R(r) R(J dr) for small dr.
inline Eigen::Matrix3d rotation_derivative(const Eigen::Vector3d& r_rad) {
  const double angle = r_rad.norm();
  const Eigen::Matrix3d cross = cross_matrix(r_rad);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() - 0.5 * cross;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / (angle * angle) * cross +
         (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
}

/// A cost's expansion about a pose that was moved by `deg_and_mm`, as a function of this motion's coordinates: degrees
/// and mm along `axes`. If the cost has no expansion there, the value is NaN.
inline MinimisationProblem::Expansion in_coordinates(const std::optional<Cost::Expansion>& about,
                                                     const Vector6d& deg_and_mm, const std::vector<int>& axes) {
  if (!about) return {std::numeric_limits<double>::quiet_NaN(), {}, {}};
  const Eigen::Vector3d r_rad = deg_and_mm.head<3>() * radians(1);
  Matrix6d motion_by_coordinates = Matrix6d::Zero();
  motion_by_coordinates.topLeftCorner<3, 3>() = rotation_derivative(r_rad) * radians(1);
  motion_by_coordinates.bottomRightCorner<3, 3>() = rotation_from_vector(r_rad).transpose();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> chosen = motion_by_coordinates(Eigen::all, axes);
  return {about->value, chosen.transpose() * about->gradient, chosen.transpose() * about->curvature * chosen};
}

}  // namespace marrow::search
