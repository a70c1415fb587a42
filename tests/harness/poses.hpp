// SPDX-License-Identifier: Apache-2.0
#pragma once
// Poses of a model, and how far two are apart.
#include <cmath>
#include <marrow/domain/pose.hpp>
#include <random>

namespace marrow::test {

/// From the CT to the world: a turn, then a shift.
inline RigidTransform placed(const Eigen::Vector3d& shift_mm,
                             const Eigen::Vector3d& turn_rad = Eigen::Vector3d::Zero()) {
  return {"world", "ct", rotation_from_vector(turn_rad), shift_mm};
}
inline Pose pose_of(const RigidTransform& world_from_model) {
  Pose pose;
  pose.world_from_model = world_from_model;
  return pose;
}
inline Pose pose_at(const Eigen::Vector3d& shift_mm, const Eigen::Vector3d& turn_rad = Eigen::Vector3d::Zero()) {
  return pose_of(placed(shift_mm, turn_rad));
}

/// Standard deviations of rotations [deg] and translations [mm] about the axes of the pose's frame.
inline Pose with_deviations(Pose pose, const Vector6d& deg_and_mm) {
  Vector6d deviations = deg_and_mm;
  deviations.head<3>() *= radians(1);
  pose.covariance = Matrix6d(deviations.cwiseAbs2().asDiagonal());
  return pose;
}

/// The angle of the rotation between two poses.
inline double turn_between_deg(const RigidTransform& one, const RigidTransform& other) {
  return degrees(geodesic_angle_rad(one.rotation, other.rotation));
}
inline double shift_between_mm(const RigidTransform& one, const RigidTransform& other) {
  return (one.translation_mm - other.translation_mm).norm();
}
/// The mean distance between the places of a surface's points.
inline double mean_distance_mm(const Mesh& model, const RigidTransform& one, const RigidTransform& other,
                               std::size_t points = 500) {
  double sum = 0;
  for (const Eigen::Vector3d& point : sample_surface(model, points)) sum += (one * point - other * point).norm();
  return sum / double(points);
}

}  // namespace marrow::test
