// SPDX-License-Identifier: Apache-2.0
#pragma once
// One fragment's pose relative to another's, both found in the same images. Errors that both share cancel.
#include "marrow/domain/pose.hpp"

namespace marrow::guide {

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

}  // namespace marrow::guide
