// SPDX-License-Identifier: Apache-2.0
#pragma once
// Solids between pairs of planes about the origin, |normal_k . x| <= 1: a box, an octahedron.
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::analytic {

using PlaneSolid = std::vector<Eigen::Vector3d>;  ///< the normals, over half the distance of their planes

PlaneSolid box_between(const Eigen::Vector3d& half_sides_mm);
PlaneSolid octahedron_between(const Eigen::Vector3d& half_diagonals_mm);

/// Length of a ray inside, in front of its start.
double chord_mm(const PlaneSolid& solid, const Eigen::Vector3d& start_mm, const Eigen::Vector3d& direction);

/// `hu` inside and -1000 outside, each voxel by the part of it that lies within.
Volume volume_of(const PlaneSolid& solid, const Grid& grid, double hu);
/// Negative inside; within, and in front of a face, the distance to the surface.
SignedField field_of(const PlaneSolid& solid, const Grid& grid);

}  // namespace marrow::analytic
