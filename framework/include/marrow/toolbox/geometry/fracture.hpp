// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

#include "marrow/domain/mesh.hpp"

namespace marrow::geometry {

/// The middle of the part of a fragment's surface that faces another fragment's: the mean of those of 3000 points on it
/// that are at most 3 mm farther from the other surface than the nearest one. Both surfaces lie as in the CT. Throws
/// Error for a surface without triangles.
Eigen::Vector3d fracture_centre_mm(const Mesh& fragment, const Mesh& other);

}  // namespace marrow::geometry
