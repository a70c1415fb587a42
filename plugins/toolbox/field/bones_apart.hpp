// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bones beside each other: how deep one lies in another, and how wide the gap between two is.
#include <vector>

#include "marrow/domain/transform.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// How deep the points lie inside a bone, in mm: the square root of the mean squared depth, in which each point counts
/// by its squared depth. So it is nearly the largest depth, but all deep points pull. 0 if none lies inside.
double penetration_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                      const RigidTransform& bone_from_points);

/// The mean distance of the nearest points from a bone's surface, in mm, negative inside. The weight of a point falls
/// by a factor e with each 0.2 mm that it is farther away than the nearest. Distances are clamped as the
/// field's are.
double gap_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
              const RigidTransform& bone_from_points);

/// The largest depth of the points inside a bone, in mm; 0 if none lies inside.
double deepest_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                  const RigidTransform& bone_from_points);

}  // namespace marrow::field
