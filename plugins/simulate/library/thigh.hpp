// SPDX-License-Identifier: Apache-2.0
#pragma once
// Soft tissue that is not an even cylinder.
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::phantom {

struct ThighShape {
  double unevenness = 0;  ///< largest change of the fat's thickness, as a share of it; 0 to 0.85
  int folds = 0;          ///< of the skin, near the isocentre
  double fold_mm = 4;     ///< height of a fold
};

/// Skin and muscle as closed surfaces in place of the bone's cylinder, 300 mm below the isocentre to 60 mm above the
/// bone. The cross-section of the muscle is the cylinder's at each height, so fat is moved, not added.
std::vector<Body> make_thigh(const Bone& bone, const ThighShape& shape, Random& random);

struct VesselShape {
  double calcified = 0.3;  ///< share of the artery's length with calcium in its wall
  double wall_mm = 0.6;    ///< thickness of the calcified wall
  int veins = 2;           ///< in the fat
};

/// The artery that runs from the inner side of the thigh to the back of the knee, and veins in the fat.
std::vector<Body> make_vessels(const Bone& bone, const VesselShape& shape, Random& random);

}  // namespace marrow::phantom
