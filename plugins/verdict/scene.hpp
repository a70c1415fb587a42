// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for verdicts: a bone that is known analytically, drawn exactly into two views, and a pose of
// it that is right or the result of a mistake.
#include <vector>

#include "marrow/conformance.hpp"

namespace marrow::conformance {

enum class Mistake {
  none,
  depth,      ///< 5 mm off along the line of sight of the frontal view
  axial,      ///< turned by 8 degrees about the long axis
  along,      ///< 5 mm off along the long axis
  half_turn,  ///< the best pose near half a turn about the long axis
  swapped,    ///< the best pose for images whose views were exchanged
  mirrored,   ///< the best pose of the bone of the other side
};

struct Scene {
  int seed = 1;  ///< of the true pose and of the errors of the outline
  Mistake mistake = Mistake::none;
};

/// All inputs of the kind but those about other poses of this bone and about other fragments. The pose has the
/// predicted deviations of a right one.
Inputs inputs_of(const Scene& scene);

}  // namespace marrow::conformance
