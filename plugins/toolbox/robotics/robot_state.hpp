// SPDX-License-Identifier: Apache-2.0
#pragma once
// A simulated robot that holds the distal fragment, and what it reports. The state holds the truth; a guide is given
// the report only.
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/robotics/hand_eye.hpp"
#include "marrow/toolbox/robotics/hexapod.hpp"

namespace marrow::robot {

/// How muscles and bones resist a fragment that is moved. A plain model: the numbers are chosen so that forces are of
/// the size that was measured at femoral shafts (Gosling et al., J Orthop Res 23, 2005: 396 N along the shaft).
struct SoftTissue {
  double tone_n = 100;       ///< pull along the shaft at the bone's right length
  double stretch_mm = 15;    ///< each such lengthening multiplies the pull by e
  double side_n_per_mm = 4;  ///< for shifts across the shaft
  double turn_nm_per_deg = 0.15;
  double bone_n_per_mm = 300;  ///< for each mm by which the bones would stick in each other

  using fields = Fields<&SoftTissue::tone_n, &SoftTissue::stretch_mm, &SoftTissue::side_n_per_mm,
                        &SoftTissue::turn_nm_per_deg, &SoftTissue::bone_n_per_mm>;
};

/// When a robot warns, and when it stops.
struct ForceLimits {
  double warn_above_n = 250, warn_above_nm = 5.6, stop_above_n = 400;

  using fields = Fields<&ForceLimits::warn_above_n, &ForceLimits::warn_above_nm, &ForceLimits::stop_above_n>;
};

struct Load {
  double force_n = 0, torque_nm = 0;

  using fields = Fields<&Load::force_n, &Load::torque_nm>;
};

/// The load on a fragment that is displaced from its right place by `displacement` (r [rad], t [mm]) along its own
/// axes, the last of which points to the other fragment, and whose bone sticks in the other's by `overlap_mm`.
inline Load load_of(const SoftTissue& tissue, const Vector6d& displacement, double overlap_mm) {
  const double longer_mm = -displacement[5];
  const double along = tissue.tone_n * std::exp(longer_mm / tissue.stretch_mm) + tissue.bone_n_per_mm * overlap_mm,
               across = tissue.side_n_per_mm * displacement.segment<2>(3).norm();
  return {std::hypot(along, across), tissue.turn_nm_per_deg * degrees(displacement.head<3>().norm())};
}

/// By how much a robot is not what its controller takes it for.
struct RobotErrors {
  double leg_sd_mm = 0.02;    ///< of each leg's length, drawn for each motion
  double joint_sd_mm = 0.05;  ///< of each coordinate of each joint, drawn once
  int robot_seed = 1;
  double give_mm_per_n = 0.002, give_deg_per_nm = 0.02;  ///< how far it yields to forces

  using fields = Fields<&RobotErrors::leg_sd_mm, &RobotErrors::joint_sd_mm, &RobotErrors::robot_seed,
                        &RobotErrors::give_mm_per_n, &RobotErrors::give_deg_per_nm>;
};

/// A hexapod as it stands, what it holds, and where both are.
struct RobotState {
  std::string fragment = "distal", reference = "proximal";  ///< what it holds, and what stays
  HexapodShape shape;
  HexapodLimits limits;
  RobotErrors errors;
  SoftTissue tissue;
  ForceLimits force;
  RigidTransform world_from_base{"world", "base"};        ///< exact
  RigidTransform platform_from_ct{"platform", "ct"};      ///< exact
  RigidTransform world_from_ct{"world", "ct"};            ///< exact, of the fragment
  RigidTransform base_from_platform{"base", "platform"};  ///< as its encoders say
  Load load_at_grip;                                      ///< it yields to what is added to this
  Load largest_load;                                      ///< since then
  int moves = 0;

  using fields = Fields<&RobotState::fragment, &RobotState::reference, &RobotState::shape, &RobotState::limits,
                        &RobotState::errors, &RobotState::tissue, &RobotState::force, &RobotState::world_from_base,
                        &RobotState::platform_from_ct, &RobotState::world_from_ct, &RobotState::base_from_platform,
                        &RobotState::load_at_grip, &RobotState::largest_load, &RobotState::moves>;
};

/// What a robot says after a motion.
struct RobotReport {
  RigidTransform done{"robot", "robot"};  ///< the motion by its encoders, in its base
  /// Where its base is, as planned: known about as well as a robot is pushed to a table.
  RigidTransform robot_from_world{"robot", "world"};
  Load load;          ///< now
  Load largest_load;  ///< during the motion
  bool is_warning = false;
  std::string stopped;      ///< why it stopped before the end of the motion; empty if it did not
  bool is_pressed = false;  ///< it stopped before too large a force

  using fields =
      Fields<&RobotReport::done, &RobotReport::robot_from_world, &RobotReport::load, &RobotReport::largest_load,
             &RobotReport::is_warning, &RobotReport::stopped, &RobotReport::is_pressed>;
};

struct GuideState {
  int pairs = 0, images = 0;                   ///< seen so far
  std::optional<RigidTransform> seen;          ///< reference from fragment, as it was seen last
  std::vector<Move> moves;                     ///< all moves so far
  RigidTransform told{"robot", "robot"};       ///< the motion that the robot was told last
  RigidTransform guess{"robot", "reference"};  ///< where the robot stands, as planned
  Matrix6d jacobian = Matrix6d::Identity();    ///< of Broyden's law, in mm (servo.hpp)
  std::vector<double> errors;                  ///< remaining way after each pair, in tolerances
  int stops = 0;                               ///< times in a row that the robot stopped early

  using fields =
      Fields<&GuideState::pairs, &GuideState::images, &GuideState::seen, &GuideState::moves, &GuideState::told,
             &GuideState::guess, &GuideState::jacobian, &GuideState::errors, &GuideState::stops>;
};

}  // namespace marrow::robot

MARROW_VALUE_TYPE(marrow::robot::RobotState, "robot_state", 1)
MARROW_VALUE_TYPE(marrow::robot::RobotReport, "robot_report", 2)

MARROW_VALUE_TYPE(marrow::robot::GuideState, "guide_state", 2)
