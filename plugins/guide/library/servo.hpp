// SPDX-License-Identifier: Apache-2.0
#pragma once
// Control laws of a closed loop that brings a fragment to its place by images (position-based visual servoing). Errors
// and motions are small motions (r [rad], t [mm]) about the fragment's middle, along the axes of the frame "reference",
// which is that of the other fragment. The error is the motion from the fragment's place to where it is now.

#include "marrow/domain/volume.hpp"
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

// One fragment's pose relative to another's, both found in the same images. Errors that both share cancel.

struct RelativePose {
  RigidTransform reference_from_fragment{"reference", "fragment"};  ///< the identity: both lie as in the CT
  /// Of a small motion (r [rad], t [mm]) about the fragment's middle along the axes of "reference". The errors of both
  /// poses count as independent. Not finite if a pose has no covariance.
  Matrix6d covariance;
};

RelativePose relative_pose(const Pose& fragment, const Pose& reference);

/// One standard deviation in the worst direction.
double rotation_deviation_rad(const Matrix6d& covariance);
double shift_deviation_mm(const Matrix6d& covariance);

// The way of a fragment to its place beside the other one, without their bones touching.

/// How far two fragments of one CT are apart. Both are given in the coordinates of the CT, where they lie as in the
/// restored bone.
class Gap {
 public:
  struct Bone {
    const Mesh& surface;
    const SignedField& field;
  };
  /// Refers to the fields. Throws Error, naming the fragments, if they are nowhere near each other in the CT.
  Gap(const Bone& moved, const Bone& reference);

  /// The least distance between both surfaces near the fracture; negative where they overlap. Distances beyond the
  /// fields' bands count as the bands.
  double distance_mm(const RigidTransform& reference_from_fragment) const;

 private:
  const SignedField& of_moved_;
  const SignedField& of_reference_;
  std::vector<Eigen::Vector3d> on_moved_, on_reference_;
};

/// The next part of the way.
struct Leg {
  Vector6d error;     ///< from the next place to where the fragment is (servo.hpp)
  std::string stage;  ///< distract, rotate, align or release
};

struct ApproachOptions {
  double clearance_mm = 1;         ///< bones are kept this far apart, but less near their place in the restored bone
  double max_distraction_mm = 14;  ///< from the fragment's final place
  double rotated_deg = 2;          ///< smaller rotations do not count as a stage of their own
  double aligned_mm = 2;           ///< the same for shifts across the shaft
};

/// Straight away from the other fragment, along its shaft.
Leg leg_apart(const FragmentFrame& frame, const FragmentFrame& reference, double by_mm);

/// Takes the straight way if it is free. Otherwise the fragment first goes to a place that is pulled away along the
/// shaft, as little as possible. If the way to this place is not free, the fragment is first pulled away from where it
/// is. If no way is free, it is turned where it is pulled away as far as allowed. `frame`: of the fragment; its long
/// axis points to the other fragment or away from it.
Leg next_leg(const Gap& gap, const RigidTransform& reference_from_fragment, const FragmentFrame& frame,
             const FragmentFrame& reference, const ApproachOptions& options);

}  // namespace marrow::guide
