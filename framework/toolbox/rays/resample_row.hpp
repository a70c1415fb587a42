// SPDX-License-Identifier: Apache-2.0
#pragma once
// The two inner loops of the sliced DRR, each with the widest vectors that the machine has.
#include <cstdint>

namespace marrow::rays {

/// mixed[i] = (1 - weight) * a[i] + weight * b[i]; a null row counts as zeros.
void mix_rows(const std::int16_t* a, const std::int16_t* b, float weight, int count, float* mixed);

/// sum[i] += row, linearly interpolated at position + step * i. All positions lie in [0, size - 1), and 32 floats
/// behind row[size - 1] may be read.
void add_resampled(const float* row, float position, float step, int count, float* sum);

}  // namespace marrow::rays
