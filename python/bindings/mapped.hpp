// SPDX-License-Identifier: Apache-2.0
#pragma once
// Volumes and signed fields whose samples are not in the object itself, but in memory that was mapped.
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::python {

/// From now on, the samples of this Volume or SignedField, whose own list is empty, are at `samples`.
void note_mapped_samples(const void* item, const float* samples);
void forget_mapped_samples(const void* item);

/// The samples of a Volume or SignedField, wherever they are.
const float* samples_of_item(const void* item, const std::vector<float>& own);

/// Whether the samples are elsewhere.
bool is_mapped(const void* item);

}  // namespace marrow::python
