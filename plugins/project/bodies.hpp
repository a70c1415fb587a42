// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the suite of projectors lays before the nodes: bodies that are known exactly, in one pose, seen from four sides.
#include <vector>

#include "marrow/conformance.hpp"
#include "marrow/runtime/types.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {

constexpr int kSize_px = 160;
constexpr double kDensity = 1.5;  ///< of what the volumes show, relative to water: 500 HU

Camera camera_at(double angle_deg);
const std::vector<double>& angles();
RigidTransform pose();

analytic::Body ball();
/// An ellipsoid, askew.
analytic::Body egg();
Grid fine_grid();

Inputs inputs_of(Volume volume, SignedField field, Mesh mesh);
Inputs inputs_of(const analytic::Body& body);

}  // namespace marrow::conformance
