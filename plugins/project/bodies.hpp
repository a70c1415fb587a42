// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for projectors: bodies that are known exactly, in one pose, seen from four sides.
#include <vector>

#include "marrow/conformance.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {

constexpr int kSize_px = 160;
constexpr double kDensity = 1.5;  ///< attenuation of the bodies relative to water: 500 HU

Camera camera_at(double angle_deg);
const std::vector<double>& angles();
RigidTransform pose();

analytic::Body ball();
/// An ellipsoid with rotated axes.
analytic::Body egg();
Grid fine_grid();

Inputs inputs_of(Volume volume, SignedField field, Mesh mesh);
Inputs inputs_of(const analytic::Body& body);

}  // namespace marrow::conformance
