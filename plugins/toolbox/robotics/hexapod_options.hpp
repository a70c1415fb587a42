// SPDX-License-Identifier: Apache-2.0
#pragma once
// The options of nodes that simulate a hexapod.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/robotics/hexapod.hpp"

namespace marrow::robot {

/// Declares the members of HexapodShape and HexapodLimits, from which `Options` is derived.
template <class Options, class Node>
Node& declare_hexapod(Node& node) {
  return node
      .option("base_radius_mm", &Options::base_radius_mm, "radius of the circle of the base's joints", at_least(1))
      .option("platform_radius_mm", &Options::platform_radius_mm, "the same for the platform", at_least(1))
      .option("base_gap_deg", &Options::base_gap_deg, "angle between the two joints of a pair of the base", at_least(0),
              at_most(119))
      .option("platform_gap_deg", &Options::platform_gap_deg, "the same for the platform", at_least(0), at_most(119))
      .option("height_mm", &Options::height_mm, "height of the platform's joints above the base's at home", at_least(1))
      .option("stroke_mm", &Options::stroke_mm, "how far a leg's length may differ from that at home, to either side",
              at_least(0))
      .option("joint_deg", &Options::joint_deg, "how far a leg may turn in its joints from its direction at home",
              at_least(0), at_most(90));
}

}  // namespace marrow::robot
