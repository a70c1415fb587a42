// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks for projectors of radiographs.
#include <vector>

#include "bodies.hpp"
#include "marrow/conformance.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::conformance {

/// All pixels of the images.
PixelGrid whole();
/// Throws Failure if the number of values is not the number of pixels.
std::vector<float> radiograph_of(const RadiographProjector& projector, const Camera& camera, const PixelGrid& grid,
                                 const RigidTransform& at = pose());

/// Compares radiographs with the chords of a ball, a box and an octahedron.
std::vector<Check> radiograph_checks();

}  // namespace marrow::conformance
