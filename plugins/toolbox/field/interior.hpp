// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "marrow/domain/transform.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::field {

/// Fills what the wall of a bone encloses: marrow canal, spongy bone and pores. Only the outer surface remains.
///
/// The test uses planes across the bone's long axis, tilted by up to 45 degrees. A voxel is enclosed if bone surrounds
/// it in at least one plane through it. So a canal that ends at a fracture or at the end of the CT is filled up to the
/// plane that fits the opening best. Grooves of the outer surface stay open, because no such plane closes them.
/// `is_bone` and `is_other` hold one byte per voxel, x fastest. Voxels of `is_other` are never filled.
void fill_interior(const marrow::Grid& grid, std::vector<std::uint8_t>& is_bone,
                   const std::vector<std::uint8_t>& is_other);

/// Turns `values_mm` into signed distances by fast marching (Sethian, PNAS 1996), clamped to `band_mm`. The values of
/// voxels beside the zero level must already be distances. They stay as they are, so the surface does not move.
void march_distances(const marrow::Grid& grid, std::vector<float>& values_mm, double band_mm);

/// Signed distance in mm, up to `band_mm`, to a closed surface in the grid's frame. Distances beside the surface are
/// exact. A voxel is inside if a line from it along the grid's z axis crosses the surface an odd number of times.
marrow::SignedField field_of_mesh(const marrow::Grid& grid, const marrow::Mesh& mesh, double band_mm);

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
