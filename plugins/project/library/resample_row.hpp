// SPDX-License-Identifier: Apache-2.0
#pragma once
// The two inner loops of the sliced DRR. Both use the widest vector registers that the machine has.
#include <cstdint>

namespace marrow::rays {

/// mixed[i] = (1 - weight) * a[i] + weight * b[i]; a null row counts as zeros.
void mix_rows(const std::int16_t* a, const std::int16_t* b, float weight, int count, float* mixed);

/// sum[i] += row, linearly interpolated at position + step * i. All positions must lie in [0, size - 1). Up to 32
/// floats after row[size - 1] are read and must be readable.
void add_resampled(const float* row, float position, float step, int count, float* sum);

}  // namespace marrow::rays
