// SPDX-License-Identifier: Apache-2.0
#pragma once
// A simulated robot that holds the distal fragment, and what it reports. The state holds the truth; a guide is given
// the report only.
#include <string>

#include "marrow/domain/transform.hpp"
#include "marrow/runtime/node/value.hpp"
#include "marrow/toolbox/robotics/hexapod.hpp"
#include "marrow/toolbox/robotics/soft_tissue.hpp"

namespace marrow::robot {

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

}  // namespace marrow::robot

MARROW_VALUE_TYPE(marrow::robot::RobotState, "robot_state", 1)
MARROW_VALUE_TYPE(marrow::robot::RobotReport, "robot_report", 2)
