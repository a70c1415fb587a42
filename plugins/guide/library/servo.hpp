// SPDX-License-Identifier: Apache-2.0
#pragma once
// Control laws of a closed loop that brings a fragment to its place by images (position-based visual servoing). Errors
// and motions are small motions (r [rad], t [mm]) about the fragment's middle, along the axes of the frame "reference",
// which is that of the other fragment. The error is the motion from the fragment's place to where it is now.
#include <string>

#include "marrow/toolbox/robotics/hand_eye.hpp"

namespace marrow::guide {

/// How large a step may be.
struct StepLimits {
  double damping = 1;  ///< lambda: the part of the error that a step takes away
  double max_rotation_deg = 15, max_shift_mm = 25;
};

/// -lambda times the error, shortened as a whole until neither limit is passed.
Vector6d limited_step(const Vector6d& error, const StepLimits& limits);

/// A motion in the frame "reference" as a transform: the new place of a point from its old place.
RigidTransform motion_of(const Vector6d& step, const Eigen::Vector3d& centre_mm);
/// The inverse of motion_of().
Vector6d step_of(const RigidTransform& motion, const Eigen::Vector3d& centre_mm);

/// The same motion as the robot must be told it.
RigidTransform told_for(const RigidTransform& seen, const RigidTransform& robot_from_reference);

/// A small motion in numbers of like size: rotations times 100 mm.
Vector6d in_mm(const Vector6d& motion);
Vector6d from_mm(const Vector6d& motion_mm);

/// Broyden's rank-one update of a Jacobian (Jagersand, Fuentes and Nelson, ICRA 1997, Eq 7): J += (dy - J dq) dq^T /
/// dq^T dq. `asked` and `seen` are small motions in mm; J maps the motions that were asked for to those that were seen.
/// It stays the same if hardly any motion was asked for.
Matrix6d broyden(const Matrix6d& jacobian, const Vector6d& asked_mm, const Vector6d& seen_mm);

/// What must be asked for so that `wanted` happens: the least |J q - w|^2 + mu^2 |q|^2. mu keeps a Jacobian that is
/// nearly singular from asking for huge motions.
Vector6d ask_for(const Matrix6d& jacobian, const Vector6d& wanted_mm, double mu = 0.3);

}  // namespace marrow::guide
