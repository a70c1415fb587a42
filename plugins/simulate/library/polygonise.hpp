// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>

#include "marrow/domain/mesh.hpp"

namespace marrow::phantom {

/// The surface field = 0 by marching tetrahedra on a grid of `spacing_mm`. It is always closed and oriented outward.
/// `field` must be continuous, negative inside, positive on the border of the box, and safe to call from several
/// threads. It must not change by more than `steepest` per mm: blocks of the grid that cannot reach the surface are
/// skipped.
Mesh polygonise(const std::function<double(const Eigen::Vector3d&)>& field, const Eigen::Vector3d& low_mm,
                const Eigen::Vector3d& high_mm, double spacing_mm, double steepest);

}  // namespace marrow::phantom
