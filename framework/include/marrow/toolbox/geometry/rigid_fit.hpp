// SPDX-License-Identifier: Apache-2.0
#pragma once
// What starts from landmarks share: the rigid motion between two sets of points, and how points move with a fragment.
#include <Eigen/Core>
#include <marrow/domain/pose.hpp>
#include <string>
#include <vector>

namespace marrow::geometry {

/// Unit normal of the plane that lies nearest to the points.
Eigen::Vector3d plane_normal(const std::vector<Eigen::Vector3d>& points_mm);
/// Whether points lie on a line, or all in one place: a fragment may turn about it unseen.
bool lie_on_a_line(const std::vector<Eigen::Vector3d>& points_mm);
/// Throws Error for fewer than three points, or points on a line. `what` names them: "the
/// tracked points".
void check_spread(const std::vector<Eigen::Vector3d>& points_mm, const std::string& what);

/// The rotation and translation of least squares that take each point of one set to that of the other: by the singular
/// value decomposition of their covariance (Arun, Huang and Blostein, IEEE PAMI 9, 1987), and where that gives a
/// reflection, by the rotation that is best then (Umeyama, IEEE PAMI 13, 1991, Eq 40 and 43). Throws Error where
/// check_spread does, or where the one set is the mirror image of the other.
RigidTransform fit_rigid(const std::vector<Eigen::Vector3d>& from_mm, const std::vector<Eigen::Vector3d>& to_mm,
                         const std::string& what);

/// Derivatives of a point by the small motion (r, t) of its fragment about `frame`, both in the frame of the model.
Eigen::Matrix<double, 3, 6> point_by_motion(const FragmentFrame& frame, const Eigen::Vector3d& model_mm);

/// A number for people: 3 digits.
std::string short_number(double value);

}  // namespace marrow::geometry
