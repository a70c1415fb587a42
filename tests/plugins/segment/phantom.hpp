// SPDX-License-Identifier: Apache-2.0
#pragma once
// Analytic hollow bones, the CT that a scanner would make of them, and how far a field's surface lies from the truth.
#include <tbb/parallel_for.h>

#include "tests/harness/node_test.hpp"

namespace marrow::test::bones {

using Distance = std::function<double(const Vector3d&)>;

/// Signed distance to a cone with spherical ends (exact).
inline double round_cone(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radius_a, double radius_b) {
  const Vector3d axis = b - a;
  const double length = axis.norm(), along = (p - a).dot(axis) / length;
  const double across = (p - a - axis / length * along).norm();
  const double sine = (radius_a - radius_b) / length, cosine = std::sqrt(1 - sine * sine);
  const double k = along * cosine - across * sine;  // foot on the cone's side, measured along it
  if (k < 0) return std::hypot(along, across) - radius_a;
  if (k > length * cosine) return std::hypot(along - length, across) - radius_b;
  return across * cosine + along * sine - radius_a;
}

/// HU at a point of the continuous scene.
using Scene = std::function<double(const Vector3d&)>;

/// Volume of a body with a soft rim as wide as the sub-voxels, which stands for their partial filling.
inline double filled(double distance_mm) { return std::clamp(0.5 - distance_mm / 0.4, 0.0, 1.0); }

inline void blur_axis(std::vector<float>& values, const std::array<int, 3>& size, int axis, double sigma) {
  std::vector<float> kernel;
  const int reach = int(std::ceil(4 * sigma));
  float sum = 0;
  for (int k = -reach; k <= reach; ++k)
    kernel.push_back(float(std::exp(-0.5 * k * k / sigma / sigma))), sum += kernel.back();
  const std::array<std::size_t, 3> steps{1, std::size_t(size[0]), std::size_t(size[0]) * size[1]};
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  tbb::parallel_for(0, size[v], [&](int j) {
    std::vector<float> line(static_cast<std::size_t>(size[axis]));
    for (int i = 0; i < size[u]; ++i) {
      float* at = values.data() + i * steps[u] + j * steps[v];
      for (int n = 0; n < size[axis]; ++n) line[std::size_t(n)] = at[n * steps[axis]];
      for (int n = 0; n < size[axis]; ++n) {
        float total = 0;
        for (int k = -reach; k <= reach; ++k)
          total += kernel[std::size_t(k + reach)] * line[std::size_t(std::clamp(n + k, 0, size[axis] - 1))];
        at[n * steps[axis]] = total / sum;
      }
    }
  });
}

/// The CT of a scene: 2 x 2 x 2 sub-voxels, a Gaussian point-spread function, the mean over each voxel, Gaussian noise.
inline Volume scan(const Grid& grid, const Scene& scene, double psf_mm, double noise_hu, unsigned seed) {
  const std::array<int, 3> fine{grid.size[0] * 2, grid.size[1] * 2, grid.size[2] * 2};
  std::vector<float> values(std::size_t(fine[0]) * fine[1] * fine[2]);
  const auto at = [&](int x, int y, int z) { return (std::size_t(z) * fine[1] + y) * fine[0] + x; };
  tbb::parallel_for(0, fine[2], [&](int z) {
    for (int y = 0; y < fine[1]; ++y)
      for (int x = 0; x < fine[0]; ++x)
        values[at(x, y, z)] = float(scene(grid.point_from_index(Vector3d(x, y, z) / 2 - Vector3d::Constant(0.25))));
  });
  for (int axis = 0; axis < 3; ++axis) blur_axis(values, fine, axis, psf_mm / grid.spacing_mm[axis] * 2);
  Volume volume{grid, std::vector<float>(grid.count())};
  std::mt19937 random(seed);
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        double sum = 0, noise = 0;
        for (int k = 0; k < 8; ++k) sum += values[at(2 * x + (k & 1), 2 * y + (k >> 1 & 1), 2 * z + (k >> 2))];
        for (int k = 0; k < 12; ++k) noise += double(random()) / double(std::mt19937::max()) - 0.5;  // variance 1
        volume.values[grid.offset(x, y, z)] = float(std::round(sum / 8 + noise_hu * noise));
      }
  return volume;
}

struct Accuracy {
  double dice = 0, bias_mm = 0, mean_mm = 0, rms_mm = 0, largest_mm = 0;
  std::size_t points = 0;
};

/// Compares a field with the true signed distance: Dice over voxels, and the true distance of each point where the
/// field's zero level crosses a grid edge, as far as `counts` says that the point counts.
inline Accuracy compare(
    const SignedField& field, const Distance& truth_mm,
    const std::function<bool(const Vector3d&)>& counts = [](const Vector3d&) { return true; }) {
  const Grid& grid = field.grid;
  Accuracy accuracy;
  double both = 0, either = 0;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        const double here = field.at(x, y, z);
        const bool inside = here < 0, truly = truth_mm(grid.point_from_index(Vector3d(x, y, z))) < 0;
        both += inside && truly;
        either += double(inside) + double(truly);
        for (int k = 0; k < 3; ++k) {
          const int i = x + (k == 0), j = y + (k == 1), l = z + (k == 2);
          if (!grid.contains(i, j, l) || (field.at(i, j, l) < 0) == inside) continue;
          Vector3d index(x, y, z);
          index[k] += here / (here - field.at(i, j, l));
          const Vector3d point = grid.point_from_index(index);
          if (!counts(point)) continue;
          const double error = truth_mm(point);
          accuracy.bias_mm += error;
          accuracy.mean_mm += std::abs(error);
          accuracy.rms_mm += error * error;
          accuracy.largest_mm = std::max(accuracy.largest_mm, std::abs(error));
          ++accuracy.points;
        }
      }
  accuracy.dice = 2 * both / either;
  accuracy.bias_mm /= double(accuracy.points);
  accuracy.mean_mm /= double(accuracy.points);
  accuracy.rms_mm = std::sqrt(accuracy.rms_mm / double(accuracy.points));
  return accuracy;
}

/// A grid with the CT's spacing, centred on the origin.
inline Grid ct_grid(const std::array<int, 3>& size) {
  const Vector3d spacing_mm(0.8, 0.8, 1.0);
  return grid_at(size, -Vector3d(size[0] - 1, size[1] - 1, size[2] - 1).cwiseProduct(spacing_mm) / 2, spacing_mm);
}

}  // namespace marrow::test::bones
