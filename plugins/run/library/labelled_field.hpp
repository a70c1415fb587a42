// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::run {

/// The signed distance in mm, up to `band_mm`, to the surface of the voxels with one of these labels; without labels,
/// of all that are not 0. The surface lies midway between a voxel inside and one outside. Throws Error if no voxel is
/// inside, and names the labels that there are.
SignedField field_of_labels(const Volume& labelled, const std::vector<double>& labels, double band_mm);

}  // namespace marrow::run
