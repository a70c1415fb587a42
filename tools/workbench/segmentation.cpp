// SPDX-License-Identifier: Apache-2.0
#include "workbench/segmentation.hpp"

#include <algorithm>
#include <cmath>

namespace marrow::workbench {
namespace {

/// Along one axis: index in the CT = first + step * index in the field.
struct AxisOfField {
  double first = 0, step = 1;
};

AxisOfField axis_of(const SignedField& field, const Grid& ct, int k) {
  const double shift_mm = ct.direction.col(k).dot(field.grid.origin_mm - ct.origin_mm);
  return {shift_mm / ct.spacing_mm[k], field.grid.spacing_mm[k] / ct.spacing_mm[k]};
}

/// The field in a plane between two of its slices.
std::vector<float> plane_of(const SignedField& field, int axis, double at) {
  const Grid& grid = field.grid;
  const int fast = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2, last = grid.size[std::size_t(axis)] - 1;
  const double clamped = std::clamp(at, 0.0, double(last));
  const int below = std::min(int(clamped), std::max(0, last - 1)), above = std::min(below + 1, last);
  const float part = float(clamped - below);
  std::vector<float> plane;
  plane.reserve(std::size_t(grid.size[std::size_t(fast)]) * std::size_t(grid.size[std::size_t(slow)]));
  std::array<int, 3> index{};
  for (int b = 0; b < grid.size[std::size_t(slow)]; ++b)
    for (int a = 0; a < grid.size[std::size_t(fast)]; ++a) {
      index[std::size_t(fast)] = a;
      index[std::size_t(slow)] = b;
      index[std::size_t(axis)] = below;
      const float low = field.at(index[0], index[1], index[2]);
      index[std::size_t(axis)] = above;
      plane.push_back(low + part * (field.at(index[0], index[1], index[2]) - low));
    }
  return plane;
}

}  // namespace

std::array<int, 3> coarse_steps(const Grid& grid, double most_voxels) {
  const Eigen::Vector3d size_mm =
      grid.spacing_mm.cwiseProduct(Eigen::Vector3d(grid.size[0], grid.size[1], grid.size[2]));
  const double side_mm = std::cbrt(size_mm.prod() / most_voxels);
  std::array<int, 3> step{1, 1, 1};
  if (double(grid.count()) > most_voxels)
    for (std::size_t k = 0; k < 3; ++k)
      step[k] = std::clamp(int(std::ceil(side_mm / grid.spacing_mm[Eigen::Index(k)])), 1, grid.size[k]);
  return step;
}

Volume coarser(const Volume& volume, const std::array<int, 3>& step) {
  Volume result;
  result.grid = volume.grid;
  Eigen::Vector3d first;
  for (std::size_t k = 0; k < 3; ++k) {
    result.grid.size[k] = (volume.grid.size[k] + step[k] - 1) / step[k];
    result.grid.spacing_mm[Eigen::Index(k)] *= step[k];
    first[Eigen::Index(k)] = 0.5 * (step[k] - 1);
  }
  result.grid.origin_mm = volume.grid.point_from_index(first);
  std::vector<double> sums(result.grid.count());
  std::vector<int> counts(result.grid.count());
  const float* value = volume.values.data();
  for (int z = 0; z < volume.grid.size[2]; ++z)
    for (int y = 0; y < volume.grid.size[1]; ++y) {
      const std::size_t row = result.grid.offset(0, y / step[1], z / step[2]);
      for (int x = 0; x < volume.grid.size[0]; ++x, ++value) {
        sums[row + std::size_t(x / step[0])] += *value;
        ++counts[row + std::size_t(x / step[0])];
      }
    }
  result.values.resize(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) result.values[i] = float(sums[i] / counts[i]);
  return result;
}

std::vector<float> outline_in_slice(const SignedField& field, const Grid& ct, int axis, int index) {
  const int fast = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2;
  const AxisOfField across = axis_of(field, ct, axis), along = axis_of(field, ct, fast), up = axis_of(field, ct, slow);
  const std::vector<float> plane = plane_of(field, axis, (index - across.first) / across.step);
  const int width = field.grid.size[std::size_t(fast)], height = field.grid.size[std::size_t(slow)];
  std::vector<float> ends;
  for (int b = 0; b + 1 < height; ++b)
    for (int a = 0; a + 1 < width; ++a) {
      // The corners of a square in turn; where the sign changes along a side, the outline crosses it.
      const float corner[4] = {plane[std::size_t(b * width + a)], plane[std::size_t(b * width + a + 1)],
                               plane[std::size_t((b + 1) * width + a + 1)], plane[std::size_t((b + 1) * width + a)]};
      static constexpr double kPlace[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
      float crossings[8];
      int count = 0;
      for (int k = 0; k < 4; ++k) {
        const float from = corner[k], to = corner[(k + 1) % 4];
        if ((from < 0) == (to < 0)) continue;
        const double part = double(from) / (double(from) - double(to));
        const auto at = [&](int i) { return kPlace[k][i] + part * (kPlace[(k + 1) % 4][i] - kPlace[k][i]); };
        crossings[count++] = float(along.first + along.step * (a + at(0)));
        crossings[count++] = float(up.first + up.step * (b + at(1)));
      }
      if (count == 4) ends.insert(ends.end(), crossings, crossings + 4);
      if (count != 8) continue;
      // A saddle: the mean says whether the two corners of the first sign are joined.
      const bool is_joined = (corner[0] + corner[1] + corner[2] + corner[3] < 0) == (corner[0] < 0);
      const int first = is_joined ? 0 : 6, second = is_joined ? 2 : 0;
      for (const int from : {first, second, is_joined ? 4 : 2, is_joined ? 6 : 4})
        ends.insert(ends.end(), {crossings[from], crossings[from + 1]});
    }
  return ends;
}

}  // namespace marrow::workbench
