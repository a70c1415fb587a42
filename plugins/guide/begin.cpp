// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/robotics/robot_state.hpp"

namespace {

marrow::robot::GuideState begin() { return {}; }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("guide.begin", begin)
      .summary("What a guide knows before the first pair of images: nothing")
      .out("state", "no pair, no move");
}
