// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a guide remembers from one pair of images to the next.
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/pose.hpp"
#include "marrow/runtime/node/value.hpp"
#include "marrow/toolbox/robotics/hand_eye.hpp"

namespace marrow::robot {

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

MARROW_VALUE_TYPE(marrow::robot::GuideState, "guide_state", 2)
