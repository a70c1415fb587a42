// SPDX-License-Identifier: Apache-2.0
#pragma once
// Solids between pairs of parallel planes around the origin, |normal_k . x| <= 1: a box, an octahedron.
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::analytic {

using PlaneSolid =
    std::vector<Eigen::Vector3d>;  ///< unit normals, each divided by its plane's distance from the origin

PlaneSolid box_between(const Eigen::Vector3d& half_sides_mm);
PlaneSolid octahedron_between(const Eigen::Vector3d& half_diagonals_mm);

/// Length in mm of the part of a ray that is inside the solid and in front of its start. `direction`: a unit vector.
double chord_mm(const PlaneSolid& solid, const Eigen::Vector3d& start_mm, const Eigen::Vector3d& direction);

/// `hu` inside and -1000 outside. A voxel at the surface is a mix, by the part of it that lies inside.
Volume volume_of(const PlaneSolid& solid, const Grid& grid, double hu);
/// Negative inside. Inside and in front of a face it is the distance to the surface. In front of an edge or a corner it
/// is smaller.
SignedField field_of(const PlaneSolid& solid, const Grid& grid);

}  // namespace marrow::analytic
