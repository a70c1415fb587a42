// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>

#include "marrow/domain/mesh.hpp"

namespace marrow::phantom {

/// The surface field = 0 of a continuous field that is negative inside and positive on the border of the box, by
/// marching tetrahedra on a grid of `spacing_mm`: always closed and oriented outward. `field` must not change by more
/// than `steepest` per mm; cubes of the grid that this keeps clear of the surface are skipped.
Mesh polygonise(const std::function<double(const Eigen::Vector3d&)>& field, const Eigen::Vector3d& low_mm,
                const Eigen::Vector3d& high_mm, double spacing_mm, double steepest);

}  // namespace marrow::phantom
