// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for starts: a long bone that is known analytically, at a known pose, with everything that
// leads to a start: lines of its shaft and landmarks in two views, tracked points, nominal placements, and a cost.
#include "marrow/conformance.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {

/// Variants of the scene.
struct Scene {
  int seed = 1;              ///< of the pose and of all errors
  bool is_mirrored = false;  ///< the bone of the other side
  bool is_turned = false;    ///< the world has other axes and another origin; the images stay the same
};

analytic::Body bone(const Scene& scene);
RigidTransform truth(const Scene& scene);
/// All inputs of the kind. The nominal placement is up to 8 degrees and 8 mm off. Marked and tracked landmarks have
/// errors of 1 px and 0.5 mm.
Inputs inputs_of(const Scene& scene);

/// A compact body in any orientation, with its edges in both views, and no placement.
struct FreeScene {
  RigidTransform truth;
  Inputs inputs;
};
FreeScene free_scene(int seed);

}  // namespace marrow::conformance
