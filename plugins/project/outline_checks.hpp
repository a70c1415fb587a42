// SPDX-License-Identifier: Apache-2.0
#pragma once
// What projectors of outlines must do.
#include <vector>

#include "marrow/conformance.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::conformance {

/// Throws Failure where points are no outline in this camera's image.
void check_outline(const std::vector<OutlinePoint>& points, const Camera& camera);

/// Outlines against the silhouette of an ellipsoid.
std::vector<Check> outline_checks();

}  // namespace marrow::conformance
