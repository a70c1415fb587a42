// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>

namespace marrow::opencl {

/// One radiograph that the kernel computes, as the kernel declares it.
struct View {
  std::array<float, 3> source, middle;
  std::array<float, 9> direction_from_pixel;
  std::array<float, 6> place_from_pixel;
  std::array<float, 9> frame_from_direction, frame_from_gradient;
  std::array<float, 3> source_mm;
  std::int32_t across;
  std::array<float, 2> first;
  float step;
  std::int32_t columns, count, with_slopes;
  std::uint32_t first_pixel, first_result;
};

/// Joseph's sums (IEEE Transactions on Medical Imaging 1982) along the ray of each pixel of each view, and their
/// derivatives by a small motion of the model; see marrow/project/rays.hpp. OpenCL C 1.2. `voxels` is the part of the
/// volume that attenuates, with a border of one empty voxel.
constexpr const char* kKernel = R"cl(
typedef struct {
  float source[3], middle[3];        // in voxels; the middle of the volume
  float direction_from_pixel[9];     // row by row; pixels are counted from the middle of the image
  float place_from_pixel[6];         // where a ray passes the middle slice, from the volume's middle, times its
                                     // direction across the slices
  float frame_from_direction[9], frame_from_gradient[9], source_mm[3];  // see RayMotion
  int across;                        // the axis from slice to slice
  float first[2], step;              // of a grid of pixels
  int columns;                       // 0: there is no grid, the pixels are in a list
  int count;                         // of pixels
  int with_slopes;
  uint first_pixel, first_result;    // where its pixels begin in the list, and its results; slopes follow the values
} View;

float3 row_times(__constant const float* m, float3 v) {
  return (float3)(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                  m[6] * v.x + m[7] * v.y + m[8] * v.z);
}

__kernel void radiograph(__global const short* voxels, int4 size, float4 spacing, __constant const View* views,
                         __global const float2* pixels, __global float* results) {
  const int i = get_global_id(0);
  __constant const View* view = views + get_global_id(1);
  const int count = view->count, with_slopes = view->with_slopes;
  if (i >= count) return;
  float3 pixel = (float3)(0.0f, 0.0f, 1.0f);
  if (view->columns > 0)
    pixel.xy = (float2)(view->first[0] + view->step * (i % view->columns),
                        view->first[1] + view->step * (i / view->columns));
  else
    pixel.xy = pixels[view->first_pixel + i];
  const float3 direction = row_times(view->direction_from_pixel, pixel);
  const float d[3] = {direction.x, direction.y, direction.z};
  const float mm[3] = {spacing.x, spacing.y, spacing.z};
  const int sizes[3] = {size.x, size.y, size.z}, strides[3] = {1, size.x, size.x * size.y};
  // The same slices for the whole image, unless a ray runs nearly along them: a change from ray to ray is a jump.
  int c = view->across;
  if (fabs(d[c] * mm[c]) < 0.4f * length((float3)(d[0] * mm[0], d[1] * mm[1], d[2] * mm[2])))
    for (int k = 0; k < 3; ++k)
      if (fabs(d[k] * mm[k]) > fabs(d[c] * mm[c])) c = k;
  const int a = c == 0 ? 1 : 0, b = c == 2 ? 1 : 2;
  const float p = d[a] / d[c], q = d[b] / d[c];
  // From the point where the ray passes the middle slice. The source is far away, so that its own place would be too
  // rough in single precision.
  const float depth = view->middle[c] - view->source[c];
  float x0 = view->source[a] + p * depth, y0 = view->source[b] + q * depth;
  if (c == view->across) {
    __constant const float* m = view->place_from_pixel;
    x0 = view->middle[a] + (m[0] * pixel.x + m[1] * pixel.y + m[2]) / d[c];
    y0 = view->middle[b] + (m[3] * pixel.x + m[4] * pixel.y + m[5]) / d[c];
  }
  // The slices between which the ray is inside the volume, and in front of the source.
  float from = 1, to = sizes[c] - 2;
  if (d[c] > 0) from = fmax(from, ceil(view->source[c]));
  else to = fmin(to, floor(view->source[c]));
  for (int k = 0; k < 2; ++k) {
    const float slope = k ? q : p, at = k ? y0 : x0, last = sizes[k ? b : a] - 1;
    if (fabs(slope) < 1e-9f) {
      if (at < 0 || at >= last) to = from - 1;
      continue;
    }
    const float s = view->middle[c] + (0 - at) / slope, t = view->middle[c] + (last - at) / slope;
    from = fmax(from, ceil(fmin(s, t)));
    to = fmin(to, floor(fmax(s, t)));
  }
  const int last_column = sizes[a] - 2, last_row = sizes[b] - 2, next_a = strides[a], next_b = strides[b];
  float sum = 0, by_p = 0, by_q = 0, by_a = 0, by_b = 0;
  for (int slice = (int)from; slice <= (int)to; ++slice) {
    const float t = slice - view->middle[c], x = x0 + p * t, y = y0 + q * t;
    const int column = clamp((int)x, 0, last_column), row = clamp((int)y, 0, last_row);
    const float u = clamp(x - column, 0.0f, 1.0f), v = clamp(y - row, 0.0f, 1.0f);
    __global const short* at = voxels + slice * strides[c] + column * next_a + row * next_b;
    const float v00 = at[0], v10 = at[next_a], v01 = at[next_b], v11 = at[next_a + next_b];
    const float low = v00 + u * (v10 - v00), high = v01 + u * (v11 - v01);
    sum += low + v * (high - low);
    if (with_slopes) {
      const float along = (v10 - v00) + v * ((v11 - v01) - (v10 - v00)), across = high - low;
      by_a += along;
      by_b += across;
      by_p += t * along;
      by_q += t * across;
    }
  }
  const float path = sqrt(p * p * mm[a] * mm[a] + q * q * mm[b] * mm[b] + mm[c] * mm[c]), factor = 1e-3f * path;
  __global float* out = results + view->first_result + i;
  *out = factor * sum;
  if (!with_slopes) return;
  // By the slopes about the middle slice, and by the source: a point of the ray there moves as far as the source does,
  // and by the depth times the change of the slope.
  const float to_p = factor * (by_p + depth * by_a) + 1e-3f * p * mm[a] * mm[a] / path * sum,
              to_q = factor * (by_q + depth * by_b) + 1e-3f * q * mm[b] * mm[b] / path * sum, nearer = 1 / d[c];
  float by_source[3], by_direction[3];
  by_source[a] = factor * by_a;
  by_source[b] = factor * by_b;
  by_source[c] = -(p * by_source[a] + q * by_source[b]);
  by_direction[a] = to_p * nearer;
  by_direction[b] = to_q * nearer;
  by_direction[c] = -(p * to_p + q * to_q) * nearer;
  const float3 force = row_times(view->frame_from_gradient, (float3)(by_source[0], by_source[1], by_source[2])),
               turning = row_times(view->frame_from_gradient,
                                   (float3)(by_direction[0], by_direction[1], by_direction[2])),
               source = (float3)(view->source_mm[0], view->source_mm[1], view->source_mm[2]),
               way = row_times(view->frame_from_direction, direction);
  const float3 torque = -cross(source, force) - cross(way, turning);
  const size_t next = count;
  out[next] = torque.x, out[2 * next] = torque.y, out[3 * next] = torque.z;
  out[4 * next] = -force.x, out[5 * next] = -force.y, out[6 * next] = -force.z;
}
)cl";

}  // namespace marrow::opencl
