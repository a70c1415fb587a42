// SPDX-License-Identifier: Apache-2.0
#pragma once
// A bone that is known analytically, two X-ray views of it, and named points whose pixels are exactly known.
#include "marrow/conformance.hpp"
#include "marrow/domain/landmarks.hpp"
#include "marrow/domain/pose.hpp"

namespace marrow::conformance {

/// A pose of the bone, drawn by its number. is_turned: the world has other axes and another origin.
struct LandmarkScene {
  int seed = 1;
  bool is_turned = false;
};

RigidTransform truth(const LandmarkScene& scene);
/// What nodes of the kind take. The start is 3 to 6 degrees and mm off the truth. The views have noise.
Inputs inputs_of(const LandmarkScene& scene);
/// The same without the bone in the views.
Inputs without_bone(const LandmarkScene& scene);

}  // namespace marrow::conformance
