// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a robot stands: the transform between its base and what the images show (hand-eye calibration).
#include <optional>
#include <vector>

#include "marrow/domain/pose.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::robot {

/// A motion of the fragment, as the robot did it and as the images show it.
struct Move {
  RigidTransform told{"robot", "robot"};          ///< in the robot's base: new place of a point from its old place
  RigidTransform seen{"reference", "reference"};  ///< the same motion, in the frame in which the fragment is seen
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< middle of the fragment before it, in the frame "reference"

  using fields = Fields<&Move::told, &Move::seen, &Move::centre_mm>;
};

/// How exactly moves are known, and how far the first guess may be off. One standard deviation each, about and along
/// each axis.
struct HandEyeNoise {
  double motion_deviation_deg = 0.15, motion_deviation_mm = 0.15;  ///< of a motion as it is seen
  double motion_deviation_fraction = 0.02;                         ///< of the motion's size, in addition
  double guess_deg = 90, guess_mm = 60;                            ///< of the guess
};

struct HandEye {
  RigidTransform robot_from_reference{"robot", "reference"};
  /// By estimate_hand_eye(): of a small motion (r [rad], t [mm]) of the robot, about the middle of the fragment before
  /// the last move, along the axes of "reference". That of the guess, if there is no move.
  Matrix6d covariance = Matrix6d::Identity();
};

/// The transform X that explains the moves best: the minimum of sum rho(|log(B_i^-1 X^-1 A_i X)|^2), with A_i as told
/// and B_i as seen. The logarithm is taken about the fragment's middle, in standard deviations. rho is Cauchy's
/// function, so that a move that failed hardly counts. The guess counts as one more, weak observation. Rotations all
/// around are tried as starts. One move alone leaves the rotation about its axis to the guess; two moves determine X if
/// their axes differ.
HandEye estimate_hand_eye(const std::vector<Move>& moves, const RigidTransform& guess, const HandEyeNoise& noise);

/// AX = XB for two motions or more with different axes, in closed form: the rotation that takes the rotation vectors of
/// B to those of A (Park and Martin, IEEE TRA 10, 1994), then the translation from (R_A - I) t_X = R_X t_B - t_A by
/// least squares. The covariance is that of a small motion of the frame "reference" about its origin, by what the
/// motions leave over; each is taken as independent of the others. Throws Error if there are too few motions, or if
/// they do not tell the rotation to 10 degrees, because they are too small or about one axis only.
HandEye solve_ax_xb(const std::vector<Move>& moves);

/// A pose of the robot's hand, and that of the target on it as the camera sees it.
struct Station {
  RigidTransform base_from_hand{"base", "hand"};
  RigidTransform world_from_target{"world", "target"};
};
struct RobotWorld {
  RigidTransform hand_from_target{"hand", "target"};  ///< X
  RigidTransform base_from_world{"base", "world"};    ///< Z
  /// Of a small motion (r [rad], t [mm]) of the world about its origin, by what the stations leave over.
  Matrix6d covariance = Matrix6d::Identity();
};

/// A_i X = Z B_i for three stations or more: both rotations from the Kronecker product (Shah, J Mech Robot 5, 2013),
/// both translations by least squares, then all twelve numbers together by the stations' residuals, 1 degree counted as
/// 1 mm. Throws Error if the stations are too few, or if they do not tell the rotation to 10 degrees, because their
/// turns are too small or about one axis only.
RobotWorld solve_ax_zb(const std::vector<Station>& stations);

/// How far from the place meant a motion of the world leaves a fragment, if it is told with a base_from_world of this
/// covariance: the covariance of a small motion (r [rad], t [mm]) about a point of the world, along its axes.
Matrix6d left_by(const RigidTransform& motion, const Matrix6d& covariance, const Eigen::Vector3d& place_mm);

}  // namespace marrow::robot
