// SPDX-License-Identifier: Apache-2.0
#pragma once
// What projectors of radiographs must do.
#include <vector>

#include "bodies.hpp"
#include "marrow/conformance.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::conformance {

/// All pixels of the images.
PixelGrid whole();
/// Throws Failure where there is not one value for each pixel.
std::vector<float> radiograph_of(const RadiographProjector& projector, const Camera& camera, const PixelGrid& grid,
                                 const RigidTransform& at = pose());

/// Radiographs against the chords of a ball, a box and an octahedron.
std::vector<Check> radiograph_checks();

}  // namespace marrow::conformance
