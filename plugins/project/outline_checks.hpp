// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks for projectors of outlines.
#include <vector>

#include "marrow/conformance.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::conformance {

/// Throws Failure if the points are not a valid outline in this camera's image.
void check_outline(const std::vector<OutlinePoint>& points, const Camera& camera);

/// Compares outlines with the silhouette of an ellipsoid.
std::vector<Check> outline_checks();

}  // namespace marrow::conformance
