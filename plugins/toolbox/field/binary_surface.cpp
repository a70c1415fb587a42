// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/field/binary_surface.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"

namespace marrow::field {
namespace {

using Index = std::uint32_t;

constexpr int kMore = 7;            // voxels that are added on each side, so that the band ends before the grid does
constexpr float kBand = 5;          // voxels farther than this from the surface stay as they are
constexpr int kSteps = 120;         // no test surface moved by 0.002 voxels after the first 100
constexpr float kLeast = 0.01f;     // from a voxel's centre to the surface, so that each keeps its side
constexpr float kStep = 1 / 144.f;  // the inverse of the greatest curvature of the energy: 12 squared

/// The mask with kMore voxels more on each side, which repeat those at its ends.
Volume widened(const Volume& mask) {
  Volume wide;
  wide.grid = mask.grid;
  for (int& size : wide.grid.size) size += 2 * kMore;
  wide.grid.origin_mm = mask.grid.point_from_index(Eigen::Vector3d::Constant(-kMore));
  wide.values.reserve(wide.grid.count());
  const auto inner = [&](int at, std::size_t axis) { return std::clamp(at - kMore, 0, mask.grid.size[axis] - 1); };
  for (int z = 0; z < wide.grid.size[2]; ++z)
    for (int y = 0; y < wide.grid.size[1]; ++y)
      for (int x = 0; x < wide.grid.size[0]; ++x) wide.values.push_back(mask.at(inner(x, 0), inner(y, 1), inner(z, 2)));
  return wide;
}

/// The lower envelope of parabolas along one line (Felzenszwalb and Huttenlocher, Theory of Computing 8, 2012): squared
/// distances along it and across the lines before.
void distances_along(std::vector<float>& line, std::vector<int>& at, std::vector<float>& from) {
  const int count = int(line.size());
  const std::vector<float> before = line;
  int last = 0;
  at[0] = 0;
  from[0] = -1e9f;
  const auto meet = [&](int a, int b) {
    return ((before[std::size_t(b)] + float(b) * float(b)) - (before[std::size_t(a)] + float(a) * float(a))) /
           (2 * float(b - a));
  };
  for (int i = 1; i < count; ++i) {
    while (last > 0 && meet(at[std::size_t(last)], i) <= from[std::size_t(last)]) --last;
    ++last;
    from[std::size_t(last)] = meet(at[std::size_t(last - 1)], i);
    at[std::size_t(last)] = i;
  }
  for (int i = 0, k = 0; i < count; ++i) {
    while (k < last && from[std::size_t(k + 1)] < float(i)) ++k;
    const int nearest = at[std::size_t(k)];
    line[std::size_t(i)] = before[std::size_t(nearest)] + float((i - nearest) * (i - nearest));
  }
}

/// For each voxel the distance in voxels to the nearest one for which `is_target`, up to a little more than the band.
std::vector<float> distances_to(const Volume& mask, bool is_target) {
  constexpr float kFar = 1e4f;
  const auto& size = mask.grid.size;
  std::vector<float> squared(mask.values.size());
  for (std::size_t i = 0; i < squared.size(); ++i) squared[i] = (mask.values[i] != 0) == is_target ? 0 : kFar;
  const std::array<std::size_t, 3> step{1, std::size_t(size[0]), std::size_t(size[0]) * std::size_t(size[1])};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    tbb::parallel_for(0, size[v], [&](int j) {
      const std::size_t length = std::size_t(size[axis]);
      std::vector<float> line(length);
      std::vector<float> from(length + 1);
      std::vector<int> at(length + 1);
      for (int i = 0; i < size[u]; ++i) {
        float* first = squared.data() + std::size_t(i) * step[u] + std::size_t(j) * step[v];
        for (std::size_t k = 0; k < length; ++k) line[k] = first[k * step[axis]];
        distances_along(line, at, from);
        for (std::size_t k = 0; k < length; ++k) first[k * step[axis]] = line[k];
      }
    });
  }
  for (float& value : squared) value = std::sqrt(value);
  return squared;
}

/// The voxels near the surface, what the mask allows there, and the search for the function that bends least.
class Bending {
 public:
  explicit Bending(const Volume& mask) : grid_(mask.grid) {
    const std::vector<float> to_outside = distances_to(mask, false), to_inside = distances_to(mask, true);
    function_.resize(mask.values.size());
    for (std::size_t i = 0; i < function_.size(); ++i)
      function_[i] = mask.values[i] != 0 ? 0.5f - to_outside[i] : to_inside[i] - 0.5f;
    for (int z = 0; z < grid_.size[2]; ++z)
      for (int y = 0; y < grid_.size[1]; ++y)
        for (int x = 0; x < grid_.size[0]; ++x) {
          const std::size_t at = grid_.offset(x, y, z);
          const Voxel voxel{Index(at), Index(x), Index(y), Index(z)};
          if (std::abs(function_[at]) <= kBand) free_.push_back(voxel);
          // What bends beside the band counts, too, or the surface would shrink.
          if (std::abs(function_[at]) <= kBand + 1.5f) bent_.push_back(voxel);
        }
  }

  /// Projected gradient steps with Nesterov's acceleration, which starts anew when it leads uphill.
  std::vector<float> found() {
    const std::vector<float> bounds = function_;
    std::vector<float> ahead = function_, bent(function_.size(), 0.0f), next(free_.size());
    double weight = 1;
    for (int step = 0; step < kSteps; ++step) {
      bend(ahead, bent);
      parallel(free_, [&](std::size_t k) {
        const std::size_t at = free_[k].at;
        next[k] = within(bounds[at], ahead[at] - kStep * laplacian(bent, free_[k]));
      });
      double uphill = 0;
      for (std::size_t k = 0; k < free_.size(); ++k) {
        const std::size_t at = free_[k].at;
        uphill += double(ahead[at] - next[k]) * double(next[k] - function_[at]);
      }
      const double grown = uphill > 0 ? 1 : (1 + std::sqrt(1 + 4 * weight * weight)) / 2;
      const float lead = uphill > 0 ? 0 : float((weight - 1) / grown);
      parallel(free_, [&](std::size_t k) {
        const std::size_t at = free_[k].at;
        ahead[at] = next[k] + lead * (next[k] - function_[at]);
        function_[at] = next[k];
      });
      weight = grown;
    }
    return std::move(function_);
  }

 private:
  struct Voxel {
    Index at, x, y, z;
  };

  template <class Visit>
  static void parallel(const std::vector<Voxel>& voxels, const Visit& visit) {
    tbb::parallel_for(std::size_t(0), (voxels.size() + 4095) / 4096, [&](std::size_t part) {
      const std::size_t end = std::min(voxels.size(), (part + 1) * 4096);
      for (std::size_t k = part * 4096; k < end; ++k) visit(k);
    });
  }

  /// The value nearest to `value` that the mask allows: a voxel at the distance d from the nearest one of the other
  /// side has its surface at a distance of d - 1 to d. `start` is half a voxel less than d, with the side's sign.
  static float within(float start, float value) {
    const float distance = std::abs(start) + 0.5f;
    const float least = std::max(kLeast, distance - 1);
    return start < 0 ? -std::clamp(-value, least, distance) : std::clamp(value, least, distance);
  }

  /// The sum of the second differences along the axes. Beyond the ends of the grid values go on as they are.
  float laplacian(const std::vector<float>& values, const Voxel& voxel) const {
    const std::size_t row = std::size_t(grid_.size[0]), slice = row * std::size_t(grid_.size[1]), at = voxel.at;
    const float here = values[at];
    float sum = -6 * here;
    sum += voxel.x > 0 ? values[at - 1] : here;
    sum += int(voxel.x) + 1 < grid_.size[0] ? values[at + 1] : here;
    sum += voxel.y > 0 ? values[at - row] : here;
    sum += int(voxel.y) + 1 < grid_.size[1] ? values[at + row] : here;
    sum += voxel.z > 0 ? values[at - slice] : here;
    sum += int(voxel.z) + 1 < grid_.size[2] ? values[at + slice] : here;
    return sum;
  }

  /// How the function bends in the band and beside it; elsewhere it stays 0, because no free voxel feels it.
  void bend(const std::vector<float>& values, std::vector<float>& bent) const {
    parallel(bent_, [&](std::size_t k) { bent[bent_[k].at] = laplacian(values, bent_[k]); });
  }

  Grid grid_;
  std::vector<float> function_;
  std::vector<Voxel> free_, bent_;
};

/// Makes distances in mm of the function's values, which count voxels, beside its level 0. Only the direction of its
/// slope counts: its size differs on both sides of the surface, which would move it.
std::vector<float> distances_mm(const Grid& grid, const std::vector<float>& function) {
  std::vector<float> distances(function.size());
  tbb::parallel_for(0, grid.size[2], [&](int z) {
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        const std::array<int, 3> at{x, y, z};
        double squared = 0, squared_mm = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          std::array<int, 3> low = at, high = at;
          low[k] = std::max(0, at[k] - 1), high[k] = std::min(grid.size[k] - 1, at[k] + 1);
          const double rise = double(function[grid.offset(high[0], high[1], high[2])]) -
                              double(function[grid.offset(low[0], low[1], low[2])]);
          const double slope = rise / double(std::max(1, high[k] - low[k]));
          squared += slope * slope;
          squared_mm += slope * slope / (grid.spacing_mm[int(k)] * grid.spacing_mm[int(k)]);
        }
        const std::size_t i = grid.offset(x, y, z);
        const double voxel_mm = squared > 0 ? std::sqrt(squared / squared_mm) : grid.spacing_mm.minCoeff();
        distances[i] = float(double(function[i]) * voxel_mm);
      }
  });
  return distances;
}

/// Ends the surface half a voxel beyond the mask's grid.
void cut_at_ends(const Grid& wide, std::vector<float>& distances) {
  for (int z = 0; z < wide.size[2]; ++z)
    for (int y = 0; y < wide.size[1]; ++y)
      for (int x = 0; x < wide.size[0]; ++x) {
        const std::array<int, 3> at{x, y, z};
        double beyond_mm = -1e9;
        for (std::size_t k = 0; k < 3; ++k) {
          const double before = kMore - 0.5 - at[k], behind = at[k] - (wide.size[k] - kMore - 0.5);
          beyond_mm = std::max(beyond_mm, std::max(before, behind) * wide.spacing_mm[int(k)]);
        }
        float& value = distances[wide.offset(x, y, z)];
        value = std::max(value, float(beyond_mm));
      }
}

}  // namespace

SignedField field_of_mask(const Volume& mask, double band_mm) {
  check_volume(mask, "mask");
  if (std::all_of(mask.values.begin(), mask.values.end(), [](float value) { return value == 0; }))
    throw Error("mask: no voxel is inside");
  const Volume wide = widened(mask);
  SignedField field{wide.grid, distances_mm(wide.grid, Bending(wide).found())};
  cut_at_ends(field.grid, field.values_mm);
  for (float& value : field.values_mm) value = std::clamp(value, -float(band_mm), float(band_mm));
  return field;
}

}  // namespace marrow::field
