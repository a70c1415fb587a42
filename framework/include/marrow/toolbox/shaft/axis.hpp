// SPDX-License-Identifier: Apache-2.0
#pragma once
// The geometry of the chapter's first stage: planes from image lines, the axis in which they meet (Eq 7), and the
// motion that brings one axis onto another (Eq 8), in the corrected forms of docs/method.md.
#include <Eigen/Core>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <vector>

namespace marrow::shaft {

struct Axis {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();

  Eigen::Vector3d nearest_to(const Eigen::Vector3d& point) const {
    return point_mm + direction * direction.dot(point - point_mm);
  }
};

/// The plane that bisects the two planes through the source and a border each (back-projected exactly, M^T l). It
/// contains the axis of a circular cylinder with these borders; the mean of the two image lines is not the image of
/// that axis. The borders must run the same way.
Plane bisecting_plane(const Camera& camera, const LineSegment& left, const LineSegment& right);

/// Eq 7: the axis that lies in all planes, in the sense of least squares; point_mm is the one nearest to the origin.
/// Throws Error when the planes meet at less than 10 degrees.
Axis axis_of_planes(const std::vector<Plane>& planes);

/// Eq 8 as corrected: T_move = global_T_target (global_T_model)^-1, both frames with z along the axis, their origins at
/// the model axis' point nearest to `anchor` and at the target axis' point nearest to that. The frames' x axes are
/// chosen so that nothing turns about the axis or slides along it. The directions' senses are matched first.
RigidTransform world_from_world_move(const Axis& model, const Axis& target, const Eigen::Vector3d& anchor);

}  // namespace marrow::shaft
