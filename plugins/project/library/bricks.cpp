// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/bricks.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace marrow::rays {
namespace {

constexpr int kSide = 4;  ///< side of a brick in voxels, and number of slices that are handled at a time

// Four numbers that the compiler keeps in one register.
using Four = float __attribute__((vector_size(16)));
using FourIntegers = std::int32_t __attribute__((vector_size(16)));
using FourVoxels = std::int16_t __attribute__((vector_size(8)));

}  // namespace

Bricks::Bricks(const Attenuation& attenuation)
    : first_(attenuation.first), last_(attenuation.last), spacing_mm_(attenuation.grid.spacing_mm) {
  if (attenuation.is_empty()) return;
  std::uint32_t stride = kSide * kSide * kSide, within = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    begin_[k] = first_[k] - kBorder;
    const int bricks = (last_[k] + kBorder - begin_[k]) / kSide + 1;
    for (int i = 0; i < bricks * kSide; ++i)
      offsets_[k].push_back(std::uint32_t(i / kSide) * stride + std::uint32_t(i % kSide) * within);
    stride *= std::uint32_t(bricks);
    within *= kSide;
  }
  values_.assign(stride, 0);
  const std::uint32_t *x = offsets(0), *y = offsets(1), *z = offsets(2);
  tbb::parallel_for(first_[2], last_[2] + 1, [&](int k) {
    for (int j = first_[1]; j <= last_[1]; ++j) {
      const std::int16_t* row = attenuation.thousandths.data() + attenuation.grid.offset(0, j, k);
      for (int i = first_[0]; i <= last_[0]; ++i) values_[x[i] + y[j] + z[k]] = row[i];
    }
  });
}

Bricks::Path Bricks::path_of(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const {
  Path path;
  const Span span = span_in_box(first_, last_, source, direction, 1);
  if (!(span.from < span.to)) return path;
  int across = 0;
  direction.cwiseProduct(spacing_mm_).cwiseAbs().maxCoeff(&across);
  path.axes = {across == 0 ? 1 : 0, across == 2 ? 1 : 2, across};
  const double entry = source[across] + span.from * direction[across],
               exit = source[across] + span.to * direction[across];
  path.begin = std::max(int(std::ceil(std::min(entry, exit))), first_[std::size_t(across)]);
  path.end = std::min(int(std::floor(std::max(entry, exit))), last_[std::size_t(across)]);
  return path;
}

float Bricks::integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const {
  const auto [axes, begin, end] = path_of(source, direction);
  if (begin > end) return 0;
  const int a = axes.first, b = axes.second, across = axes.across;
  const Eigen::Vector3d slope = direction / direction[across];
  const std::uint32_t *slices = offsets(across), *columns = offsets(a), *rows = offsets(b);
  // From this origin all positions are positive, so that truncation rounds down.
  const int left = first_[std::size_t(a)] - 3, top = first_[std::size_t(b)] - 3;
  const float x = float(source[a] + slope[a] * (begin - source[across]) - left),
              y = float(source[b] + slope[b] * (begin - source[across]) - top);
  const float dx = float(slope[a]), dy = float(slope[b]);
  columns += left;
  rows += top;
  Four sum{0, 0, 0, 0};
  for (int first = begin; first <= end; first += kSide) {
    // The brick that the ray will enter soon, and its neighbour. Without this, half of the time is spent waiting for
    // memory.
    const int ahead = std::min(first + 4 * kSide, end), i_ahead = int(x + dx * float(ahead - begin)),
              j_ahead = int(y + dy * float(ahead - begin));
    __builtin_prefetch(values_.data() + slices[ahead] + rows[j_ahead] + columns[i_ahead]);
    __builtin_prefetch(values_.data() + slices[ahead] + rows[j_ahead + 1] + columns[i_ahead + 1]);
    // Positions of the ray in four slices.
    const float n = float(first - begin);
    const Four steps{n, n + 1, n + 2, n + 3}, px = x + dx * steps, py = y + dy * steps;
    const FourIntegers i = __builtin_convertvector(px, FourIntegers), j = __builtin_convertvector(py, FourIntegers);
    const Four u = px - __builtin_convertvector(i, Four), v = py - __builtin_convertvector(j, Four);
    const int count = std::min(kSide, end - first + 1);
    for (int k = 0; k < count; ++k) {
      const std::int16_t *near_row = values_.data() + slices[first + k] + rows[j[k]],
                         *far_row = values_.data() + slices[first + k] + rows[j[k] + 1];
      const std::uint32_t c = columns[i[k]], d = columns[i[k] + 1];
      const FourVoxels voxels{near_row[c], near_row[d], far_row[c], far_row[d]};
      const Four across_row{1 - u[k], u[k], 1 - u[k], u[k]}, across_rows{1 - v[k], 1 - v[k], v[k], v[k]};
      sum += across_row * across_rows * __builtin_convertvector(voxels, Four);
    }
  }
  return float(double(sum[0] + sum[1] + sum[2] + sum[3]) * slope.cwiseProduct(spacing_mm_).norm() * 1e-3);
}

RayMotion::Change Bricks::change(const RayMotion& motion, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d& source = motion.rays().source;
  const auto [axes, begin, end] = path_of(source, direction);
  const Eigen::Vector3d slope = direction / direction[axes.across];
  SliceSums sums;
  for (int slice = begin; slice <= end; ++slice) {
    const double depth = slice - source[axes.across], x = source[axes.first] + slope[axes.first] * depth,
                 y = source[axes.second] + slope[axes.second] * depth;
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const double u = x - i, v = y - j;
    const std::int16_t* at = values_.data() + offsets(axes.across)[slice];
    const std::uint32_t *columns = offsets(axes.first) + i, *rows = offsets(axes.second) + j;
    const double a = at[rows[0] + columns[0]], b = at[rows[0] + columns[1]], c = at[rows[1] + columns[0]],
                 d = at[rows[1] + columns[1]];
    const double along = (1 - v) * (b - a) + v * (d - c), across = (1 - u) * (c - a) + u * (d - b);
    sums.sum += (1 - v) * (a + u * (b - a)) + v * (c + u * (d - c));
    sums.by_p += depth * along;
    sums.by_q += depth * across;
    sums.by_first += along;
    sums.by_second += across;
  }
  return motion.change(sums, axes, 1, direction);
}

}  // namespace marrow::rays
