// SPDX-License-Identifier: Apache-2.0
#pragma once
// The inner loops of the sliced DRR. They use the widest vector registers that the machine has.
#include <cstdint>

namespace marrow::rays {

/// mixed[i] = (1 - weight) * a[i] + weight * b[i]; a null row counts as zeros.
void mix_rows(const std::int16_t* a, const std::int16_t* b, float weight, int count, float* mixed);

/// sum[i] += row, linearly interpolated at position + step * i. All positions must lie in [0, size - 1). Up to 32
/// floats after row[size - 1] are read and must be readable.
void add_resampled(const float* row, float position, float step, int count, float* sum);

/// change[i] = b[i] - a[i]; a null row counts as zeros.
void subtract_rows(const std::int16_t* a, const std::int16_t* b, int count, float* change);

/// Where add_resampled_slopes() adds: the values, their slope along the row, and the values of `change`.
struct ResampledSums {
  float *values, *along, *across;
};
/// Adds `row` as add_resampled() does, and in the same pass `weight` times its slope per voxel and times the
/// interpolated `change`.
void add_resampled_slopes(const float* row, const float* change, float position, float step, int count, float weight,
                          const ResampledSums& sums);

}  // namespace marrow::rays
