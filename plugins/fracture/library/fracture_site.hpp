// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where two fragments of one CT face each other.

#include "marrow/domain/mesh.hpp"

namespace marrow::fracture {

/// For each point the squared distance from the nearest of `others`, which must not be empty.
std::vector<double> nearest_squared_mm2(const std::vector<Eigen::Vector3d>& points_mm,
                                        const std::vector<Eigen::Vector3d>& others_mm);

/// The middle of the fracture in the CT, which shows both fragments in place: half way between the centres of the two
/// faces. A fragment's face is the part of its surface that is at most 3 mm farther from the other fragment than its
/// nearest point. Throws Error, naming the fragments, as check_mesh() does, if the surfaces are in other frames, and if
/// they are nowhere within 20 mm of each other.
Eigen::Vector3d middle_of_fracture_mm(const Mesh& moved, const std::string& moved_name, const Mesh& reference,
                                      const std::string& reference_name);

}  // namespace marrow::fracture
