// SPDX-License-Identifier: Apache-2.0
#pragma once
// What both nodes of this kind do before and after they triangulate.
#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"

namespace surface {

/// Throws Error for an empty field, missing or non-finite values, or a field with no surface.
void check_field(const marrow::SignedField& field);

/// The component that encloses the largest volume (an inner wall encloses a negative one), its vertices in their old
/// order.
marrow::Mesh largest_component(const marrow::Mesh& mesh);

/// Smooths without shrinking: `iterations` pairs of a smoothing and an inflating step (Taubin, A signal processing
/// approach to fair surface design, SIGGRAPH 1995, with lambda 0.5 and pass band 0.1).
void smooth(marrow::Mesh& mesh, int iterations);

}  // namespace surface
