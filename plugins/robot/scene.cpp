// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/phantom/phantom.hpp"
#include "marrow/toolbox/robotics/robot_state.hpp"

namespace {

using namespace marrow;

phantom::Phantom scene(const phantom::Phantom& phantom, const robot::RobotState& state) {
  phantom::Phantom now = phantom;
  phantom::fragment_named(phantom, state.fragment, "robot.scene");
  for (phantom::Fragment& fragment : now.fragments)
    if (fragment.name == state.fragment) fragment.world_from_ct = state.world_from_ct;
  return now;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("robot.scene", scene)
      .summary("The broken bone with the fragment where the robot holds it now")
      .in("phantom", "the bone before the robot moved it")
      .in("state", "the robot")
      .out("phantom", "the bone now, to take images of");
}
