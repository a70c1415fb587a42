// SPDX-License-Identifier: Apache-2.0
#pragma once
// For start poses from landmarks: the rigid motion between two sets of points, and how points move with a fragment.
#include <Eigen/Core>
#include <marrow/domain/pose.hpp>
#include <string>
#include <vector>

namespace marrow::geometry {

/// Unit normal of the plane fitted to the points.
Eigen::Vector3d plane_normal(const std::vector<Eigen::Vector3d>& points_mm);
/// Whether the points lie nearly on one line (their width is at most 1 % of their length) or in one place. Then a
/// rotation about this line cannot be determined.
bool lie_on_a_line(const std::vector<Eigen::Vector3d>& points_mm);
/// Throws Error for fewer than three points, or points on a line. `what` names them in the message, for example "the
/// tracked points".
void check_spread(const std::vector<Eigen::Vector3d>& points_mm, const std::string& what);

/// world_from_ct that maps `from_mm` (CT) to `to_mm` (world) in the least-squares sense. Both hold the same number of
/// points, in the same order. The rotation comes from the singular value decomposition of the covariance (Arun, Huang
/// and Blostein, IEEE PAMI 9, 1987). If that gives a reflection, it is the best rotation by Umeyama (IEEE PAMI 13,
/// 1991, Eq 40 and 43). Throws Error if check_spread() refuses one of the sets, or if one is the mirror image of the
/// other.
RigidTransform fit_rigid(const std::vector<Eigen::Vector3d>& from_mm, const std::vector<Eigen::Vector3d>& to_mm,
                         const std::string& what);

/// Derivatives of a point by the small motion (r [rad], t [mm]) of its fragment about `frame`. Point and `frame` are in
/// the frame of the model, and so is the result.
Eigen::Matrix<double, 3, 6> point_by_motion(const FragmentFrame& frame, const Eigen::Vector3d& model_mm);

}  // namespace marrow::geometry
