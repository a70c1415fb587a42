// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pose that shows landmarks where views see them: least squares of the distances in the images, each in units of
// its deviation.
#include <Eigen/Core>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/pose.hpp>
#include <string>
#include <vector>

namespace marrow::initial {

// Start poses from landmarks in views, in closed form. Some are near a minimum of the reprojection error, others are
// useless: refine all of them and compare.

/// A landmark seen in a view. The camera is that of the view and must not be null.
struct Sight {
  std::string name, view;
  Eigen::Vector3d model_mm;
  Eigen::Vector2d pixel;
  const Camera* camera;
  double deviation_px = 1;  ///< standard deviation of each coordinate of the pixel
};

/// Poses world_from_ct: one from the landmarks that two or more views show, triangulated from their rays, and several
/// from each view that shows three or more landmarks. May be empty. Throws Error if the triangulated landmarks are the
/// mirror image of those in the CT.
std::vector<RigidTransform> pose_starts(const std::vector<Sight>& sights);

/// Squared distance [px^2] of a sight from where the pose shows it, by the square of its deviation; infinite if the
/// landmark lies behind the source.
double square_of(const Sight& sight, const RigidTransform& pose);
/// The sum over all sights.
double squares_of(const std::vector<Sight>& sights, const RigidTransform& pose);

/// The inverse covariance of a small motion in `frame` that the sights' deviations give (half the Gauss-Newton Hessian
/// of squares_of).
Matrix6d curvature_at(const std::vector<Sight>& sights, const RigidTransform& pose, const FragmentFrame& frame);

/// The minimum of squares_of near a pose, by damped steps (Marquardt, SIAM J Appl Math 1963).
RigidTransform refined(const std::vector<Sight>& sights, RigidTransform pose, const FragmentFrame& frame);

struct Candidate {
  RigidTransform pose;
  double squares = 0;
};
/// The minima found from pose_starts(), the lowest first. Throws Error as pose_starts() does.
std::vector<Candidate> minima(const std::vector<Sight>& sights, const FragmentFrame& frame);

}  // namespace marrow::initial
