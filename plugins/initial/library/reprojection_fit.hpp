// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pose that shows landmarks where views see them: least squares of the distances in the images, each in units of
// its deviation.
#include <marrow/domain/pose.hpp>
#include <vector>

#include "marrow/initial/pose_starts.hpp"

namespace marrow::initial {

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
