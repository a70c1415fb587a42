// SPDX-License-Identifier: Apache-2.0
#include "resample_row.hpp"

#include <algorithm>
#include <cmath>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace marrow::rays {
namespace {

void mix_plain(const std::int16_t* a, const std::int16_t* b, float weight, int count, float* mixed) {
  const float other = 1 - weight;
  for (int i = 0; i < count; ++i) mixed[i] = other * float(a[i]) + weight * float(b[i]);
}

void add_plain(const float* row, float position, float step, int first, int count, float* sum) {
  for (int i = first; i < count; ++i) {
    const float x = position + step * float(i);
    const int n = int(x);
    const float fraction = x - float(n);
    sum[i] += row[n] + fraction * (row[n + 1] - row[n]);
  }
}

void add_slopes_plain(const float* row, const float* change, float position, float step, int first, int count,
                      float weight, const ResampledSums& sums) {
  for (int i = first; i < count; ++i) {
    const float x = position + step * float(i);
    const int n = int(x);
    const float fraction = x - float(n), slope = row[n + 1] - row[n];
    sums.values[i] += row[n] + fraction * slope;
    sums.along[i] += weight * slope;
    sums.across[i] += weight * (change[n] + fraction * (change[n + 1] - change[n]));
  }
}

#if defined(__x86_64__)

__attribute__((target("avx2"))) void mix_avx2(const std::int16_t* a, const std::int16_t* b, float weight, int count,
                                              float* mixed) {
  const __m256 w = _mm256_set1_ps(weight), v = _mm256_set1_ps(1 - weight);
  int i = 0;
  for (; i + 8 <= count; i += 8) {
    const __m256 x =
        _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(a + i))));
    const __m256 y =
        _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(b + i))));
    _mm256_storeu_ps(mixed + i, _mm256_add_ps(_mm256_mul_ps(v, x), _mm256_mul_ps(w, y)));
  }
  mix_plain(a + i, b + i, weight, count - i, mixed + i);
}

__attribute__((target("avx512f"))) void mix_avx512(const std::int16_t* a, const std::int16_t* b, float weight,
                                                   int count, float* mixed) {
  const __m512 w = _mm512_set1_ps(weight), v = _mm512_set1_ps(1 - weight);
  int i = 0;
  for (; i + 16 <= count; i += 16) {
    const __m512 x =
        _mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(a + i))));
    const __m512 y =
        _mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(b + i))));
    _mm512_storeu_ps(mixed + i, _mm512_add_ps(_mm512_mul_ps(v, x), _mm512_mul_ps(w, y)));
  }
  mix_avx2(a + i, b + i, weight, count - i, mixed + i);
}

/// The floats at eight places, all of them within `registers` times eight floats. Two permuted registers are faster
/// than a gather on many machines.
template <int registers>
__attribute__((target("avx2"))) inline __m256 look_up(const __m256 (&floats)[registers], __m256i at) {
  __m256 found = _mm256_permutevar8x32_ps(floats[0], at);
  for (int k = 1; k < registers; ++k)
    found = _mm256_blendv_ps(found, _mm256_permutevar8x32_ps(floats[k], at),
                             _mm256_castsi256_ps(_mm256_cmpgt_epi32(at, _mm256_set1_epi32(8 * k - 1))));
  return found;
}

/// The floats at eight places and those after them. `registers` as in add_avx2().
struct Eight {
  __m256 low, high;
};
template <int registers>
__attribute__((target("avx2"))) inline Eight neighbours(const float* row, __m256i n, bool is_forward) {
  if constexpr (registers == 0) return {_mm256_i32gather_ps(row, n, 4), _mm256_i32gather_ps(row + 1, n, 4)};
  const int base = is_forward ? _mm256_extract_epi32(n, 0) : _mm256_extract_epi32(n, 7);
  __m256 floats[registers > 0 ? registers : 1];
  for (int k = 0; k < registers; ++k) floats[k] = _mm256_loadu_ps(row + base + 8 * k);
  const __m256i at = _mm256_sub_epi32(n, _mm256_set1_epi32(base));
  return {look_up(floats, at), look_up(floats, _mm256_add_epi32(at, _mm256_set1_epi32(1)))};
}

/// For steps so small that eight positions and their neighbours lie within `registers` times eight floats; 0: for all.
template <int registers>
__attribute__((target("avx2"))) int add_avx2(const float* row, float position, float step, int count, float* sum) {
  const __m256 lanes = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7), steps = _mm256_set1_ps(step);
  int i = 0;
  for (; i + 8 <= count; i += 8) {
    const __m256 x =
        _mm256_add_ps(_mm256_set1_ps(position), _mm256_mul_ps(steps, _mm256_add_ps(_mm256_set1_ps(float(i)), lanes)));
    const __m256i n = _mm256_cvttps_epi32(x);
    const __m256 fraction = _mm256_sub_ps(x, _mm256_cvtepi32_ps(n));
    const auto [low, high] = neighbours<registers>(row, n, step >= 0);
    const __m256 value = _mm256_add_ps(low, _mm256_mul_ps(fraction, _mm256_sub_ps(high, low)));
    _mm256_storeu_ps(sum + i, _mm256_add_ps(_mm256_loadu_ps(sum + i), value));
  }
  return i;
}

__attribute__((target("avx2"))) inline void add_to(float* sum, __m256 value) {
  _mm256_storeu_ps(sum, _mm256_add_ps(_mm256_loadu_ps(sum), value));
}

template <int registers>
__attribute__((target("avx2"))) int add_slopes_avx2(const float* row, const float* change, float position, float step,
                                                    int count, float weight, const ResampledSums& sums) {
  const __m256 lanes = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7), steps = _mm256_set1_ps(step),
               weights = _mm256_set1_ps(weight);
  int i = 0;
  for (; i + 8 <= count; i += 8) {
    const __m256 x =
        _mm256_add_ps(_mm256_set1_ps(position), _mm256_mul_ps(steps, _mm256_add_ps(_mm256_set1_ps(float(i)), lanes)));
    const __m256i n = _mm256_cvttps_epi32(x);
    const __m256 fraction = _mm256_sub_ps(x, _mm256_cvtepi32_ps(n));
    const auto [low, high] = neighbours<registers>(row, n, step >= 0);
    const auto [from, to] = neighbours<registers>(change, n, step >= 0);
    const __m256 slope = _mm256_sub_ps(high, low);
    const __m256 across = _mm256_add_ps(from, _mm256_mul_ps(fraction, _mm256_sub_ps(to, from)));
    add_to(sums.values + i, _mm256_add_ps(low, _mm256_mul_ps(fraction, slope)));
    add_to(sums.along + i, _mm256_mul_ps(weights, slope));
    add_to(sums.across + i, _mm256_mul_ps(weights, across));
  }
  return i;
}

/// The floats at sixteen places and those after them. All lie within 32 floats from `base` on if is_near.
struct Sixteen {
  __m512 low, high;
};
__attribute__((target("avx512f"))) inline Sixteen neighbours(const float* row, __m512i n, bool is_near, int base) {
  if (!is_near) return {_mm512_i32gather_ps(n, row, 4), _mm512_i32gather_ps(n, row + 1, 4)};
  const __m512 first = _mm512_loadu_ps(row + base), second = _mm512_loadu_ps(row + base + 16);
  const __m512i at = _mm512_sub_epi32(n, _mm512_set1_epi32(base));
  return {_mm512_permutex2var_ps(first, at, second),
          _mm512_permutex2var_ps(first, _mm512_add_epi32(at, _mm512_set1_epi32(1)), second)};
}
__attribute__((target("avx512f"))) inline void add_to(float* sum, __m512 value) {
  _mm512_storeu_ps(sum, _mm512_add_ps(_mm512_loadu_ps(sum), value));
}

constexpr float kNear = 1.9f;  ///< longest step for which 15 steps and one neighbour lie within 32 floats
/// The place before the least position of sixteen. One voxel earlier, because the least position may be rounded
/// differently from the lane's own.
int base_of(float least) { return std::max(int(least) - 1, 0); }

__attribute__((target("avx512f"))) int add_avx512(const float* row, float position, float step, int count, float* sum) {
  const __m512 lanes = _mm512_setr_ps(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
               steps = _mm512_set1_ps(step);
  const bool is_near = std::abs(step) <= kNear;
  const float back = step >= 0 ? 0 : 15 * step;
  int i = 0;
  for (; i + 16 <= count; i += 16) {
    const __m512 x =
        _mm512_add_ps(_mm512_set1_ps(position), _mm512_mul_ps(steps, _mm512_add_ps(_mm512_set1_ps(float(i)), lanes)));
    const __m512i n = _mm512_cvttps_epi32(x);
    const __m512 fraction = _mm512_sub_ps(x, _mm512_cvtepi32_ps(n));
    const auto [low, high] = neighbours(row, n, is_near, base_of(position + step * float(i) + back));
    add_to(sum + i, _mm512_add_ps(low, _mm512_mul_ps(fraction, _mm512_sub_ps(high, low))));
  }
  return i;
}

__attribute__((target("avx512f"))) int add_slopes_avx512(const float* row, const float* change, float position,
                                                         float step, int count, float weight,
                                                         const ResampledSums& sums) {
  const __m512 lanes = _mm512_setr_ps(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
               steps = _mm512_set1_ps(step), weights = _mm512_set1_ps(weight);
  const bool is_near = std::abs(step) <= kNear;
  const float back = step >= 0 ? 0 : 15 * step;
  int i = 0;
  for (; i + 16 <= count; i += 16) {
    const __m512 x =
        _mm512_add_ps(_mm512_set1_ps(position), _mm512_mul_ps(steps, _mm512_add_ps(_mm512_set1_ps(float(i)), lanes)));
    const __m512i n = _mm512_cvttps_epi32(x);
    const __m512 fraction = _mm512_sub_ps(x, _mm512_cvtepi32_ps(n));
    const int base = base_of(position + step * float(i) + back);
    const auto [low, high] = neighbours(row, n, is_near, base);
    const auto [from, to] = neighbours(change, n, is_near, base);
    const __m512 slope = _mm512_sub_ps(high, low);
    const __m512 across = _mm512_add_ps(from, _mm512_mul_ps(fraction, _mm512_sub_ps(to, from)));
    add_to(sums.values + i, _mm512_add_ps(low, _mm512_mul_ps(fraction, slope)));
    add_to(sums.along + i, _mm512_mul_ps(weights, slope));
    add_to(sums.across + i, _mm512_mul_ps(weights, across));
  }
  return i;
}

const bool kHasAvx2 = __builtin_cpu_supports("avx2"), kHasAvx512 = __builtin_cpu_supports("avx512f");

#endif

}  // namespace

void mix_rows(const std::int16_t* a, const std::int16_t* b, float weight, int count, float* mixed) {
  if (!a || !b) {
    const std::int16_t* row = a ? a : b;
    const float factor = a ? 1 - weight : weight;
    for (int i = 0; i < count; ++i) mixed[i] = row ? factor * float(row[i]) : 0;
    return;
  }
#if defined(__x86_64__)
  if (kHasAvx512) return mix_avx512(a, b, weight, count, mixed);
  if (kHasAvx2) return mix_avx2(a, b, weight, count, mixed);
#endif
  mix_plain(a, b, weight, count, mixed);
}

void add_resampled(const float* row, float position, float step, int count, float* sum) {
  int done = 0;
#if defined(__x86_64__)
  if (kHasAvx512)
    done = add_avx512(row, position, step, count, sum);
  else if (kHasAvx2 && std::abs(step) <= 0.7f)
    done = add_avx2<1>(row, position, step, count, sum);
  else if (kHasAvx2 && std::abs(step) <= 1.9f)
    done = add_avx2<2>(row, position, step, count, sum);
  else if (kHasAvx2)
    done = add_avx2<0>(row, position, step, count, sum);
#endif
  add_plain(row, position, step, done, count, sum);
}

void subtract_rows(const std::int16_t* a, const std::int16_t* b, int count, float* change) {
  for (int i = 0; i < count; ++i) change[i] = (b ? float(b[i]) : 0) - (a ? float(a[i]) : 0);
}

void add_resampled_slopes(const float* row, const float* change, float position, float step, int count, float weight,
                          const ResampledSums& sums) {
  int done = 0;
#if defined(__x86_64__)
  if (kHasAvx512)
    done = add_slopes_avx512(row, change, position, step, count, weight, sums);
  else if (kHasAvx2 && std::abs(step) <= 0.7f)
    done = add_slopes_avx2<1>(row, change, position, step, count, weight, sums);
  else if (kHasAvx2 && std::abs(step) <= 1.9f)
    done = add_slopes_avx2<2>(row, change, position, step, count, weight, sums);
  else if (kHasAvx2)
    done = add_slopes_avx2<0>(row, change, position, step, count, weight, sums);
#endif
  add_slopes_plain(row, change, position, step, done, count, weight, sums);
}

}  // namespace marrow::rays
