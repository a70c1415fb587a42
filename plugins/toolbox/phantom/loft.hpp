// SPDX-License-Identifier: Apache-2.0
#pragma once
// Closed surfaces along a curve.
#include <vector>

#include "marrow/domain/mesh.hpp"

namespace marrow::phantom {

using Points = std::vector<Eigen::Vector3d>;

/// A closed surface through rings of points, all of the same number. Each ring runs counter-clockwise if seen from the
/// next one. Both ends are closed by fans around their middle.
Mesh loft(const std::vector<Points>& rings);

/// A tube along a curve, with one radius for each of its points. The corners lie on the radius.
Mesh tube(const Points& curve_mm, const std::vector<double>& radii_mm, int sides = 48);
Mesh tube(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm, double radius_mm, int sides = 48);

/// A bar of rectangular section along a curve. Its flat side points to `up`, which must not be parallel to the curve.
/// `width_mm` is measured across `up` and the curve.
Mesh bar(const Points& curve_mm, const Eigen::Vector3d& up, double width_mm, double thickness_mm);

}  // namespace marrow::phantom
