// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/field/mask_field.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "marrow/toolbox/field/interior.hpp"

namespace marrow::field {
namespace {

constexpr int kReach = 3;
constexpr double kSigma = 0.8;  // voxels

std::array<float, 2 * kReach + 1> weights() {
  std::array<float, 2 * kReach + 1> weights{};
  double sum = 0;
  for (int i = -kReach; i <= kReach; ++i) sum += std::exp(-0.5 * i * i / (kSigma * kSigma));
  for (int i = -kReach; i <= kReach; ++i)
    weights[std::size_t(i + kReach)] = float(std::exp(-0.5 * i * i / (kSigma * kSigma)) / sum);
  return weights;
}

/// Smooths along one axis.
std::vector<float> smoothed(const Grid& grid, const std::vector<float>& values, int axis) {
  const auto weight = weights();
  const std::size_t step[3] = {1, std::size_t(grid.size[0]), std::size_t(grid.size[0]) * std::size_t(grid.size[1])};
  const long along = long(step[axis]);
  const int length = grid.size[std::size_t(axis)];
  std::vector<float> result(values.size());
  tbb::parallel_for(0, grid.size[2], [&](int z) {
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        const int at[3] = {x, y, z};
        const std::size_t voxel = grid.offset(x, y, z);
        float sum = 0;
        const int first = std::max(-kReach, -at[axis]), last = std::min(kReach, length - 1 - at[axis]);
        for (int i = first; i <= last; ++i)
          sum += weight[std::size_t(i + kReach)] * values[std::size_t(long(voxel) + i * along)];
        result[voxel] = sum;
      }
  });
  return result;
}

}  // namespace

SignedField field_of_mask(const Grid& grid, const std::vector<std::uint8_t>& inside, double band_mm) {
  std::vector<float> part(inside.size());
  std::transform(inside.begin(), inside.end(), part.begin(),
                 [](std::uint8_t is_inside) { return is_inside ? 1.f : 0.f; });
  for (int axis = 0; axis < 3; ++axis) part = smoothed(grid, part, axis);
  SignedField field{grid, std::vector<float>(part.size(), float(band_mm))};
  tbb::parallel_for(0, grid.size[2], [&](int z) {
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        const std::size_t voxel = grid.offset(x, y, z);
        const int at[3] = {x, y, z};
        double slope = 0;  // squared, per mm
        for (int k = 0; k < 3; ++k) {
          int low[3] = {x, y, z}, high[3] = {x, y, z};
          low[k] = std::max(0, at[k] - 1);
          high[k] = std::min(grid.size[std::size_t(k)] - 1, at[k] + 1);
          const double difference =
              double(part[grid.offset(high[0], high[1], high[2])]) - double(part[grid.offset(low[0], low[1], low[2])]);
          slope += std::pow(difference / (std::max(1, high[k] - low[k]) * grid.spacing_mm[k]), 2);
        }
        const double lack = 0.5 - double(part[voxel]);
        const double distance = slope > 1e-12 ? lack / std::sqrt(slope) : (lack < 0 ? -band_mm : band_mm);
        field.values_mm[voxel] = float(std::clamp(distance, -band_mm, band_mm));
      }
  });
  march_distances(grid, field.values_mm, band_mm);
  return field;
}

}  // namespace marrow::field
