// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/attenuation.hpp"

#include <tbb/parallel_for.h>

namespace marrow::rays {
namespace {

void find_box(Attenuation& attenuation) {
  const Grid& grid = attenuation.grid;
  std::array<int, 3> first = grid.size, last{-1, -1, -1};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y) {
      const std::int16_t* row = attenuation.thousandths.data() + grid.offset(0, y, z);
      int a = 0, b = grid.size[0] - 1;
      while (a <= b && row[a] == 0) ++a;
      while (b > a && row[b] == 0) --b;
      if (a > b) continue;
      const std::array<int, 3> low{a, y, z}, high{b, y, z};
      for (std::size_t k = 0; k < 3; ++k) {
        first[k] = std::min(first[k], low[k]);
        last[k] = std::max(last[k], high[k]);
      }
    }
  attenuation.first = first;
  attenuation.last = last;
}

/// Weights of a sampled Gaussian from -reach to reach. Their sum is 1.
std::vector<float> gaussian(double sigma, int reach) {
  std::vector<float> weights;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) sum += std::exp(-0.5 * i * i / (sigma * sigma));
  for (int i = -reach; i <= reach; ++i) weights.push_back(float(std::exp(-0.5 * i * i / (sigma * sigma)) / sum));
  return weights;
}

/// The part of the volume that attenuates, with a border of `reach` voxels.
std::vector<float> padded(const Attenuation& attenuation, const std::array<int, 3>& reach,
                          const std::array<int, 3>& size) {
  std::vector<float> values(std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]), 0.0f);
  const auto& [first, last] = std::pair(attenuation.first, attenuation.last);
  for (int z = first[2]; z <= last[2]; ++z)
    for (int y = first[1]; y <= last[1]; ++y) {
      const std::int16_t* from = attenuation.thousandths.data() + attenuation.grid.offset(first[0], y, z);
      const int row = (z - first[2] + reach[2]) * size[1] + y - first[1] + reach[1];
      std::copy_n(from, last[0] - first[0] + 1, values.begin() + std::ptrdiff_t(row) * size[0] + reach[0]);
    }
  return values;
}

/// Smooths along one axis. Values beyond the ends are 0. Whole rows of voxels are added at a time; along the rows
/// themselves single voxels.
void smooth(std::vector<float>& values, const std::array<int, 3>& size, std::size_t axis,
            const std::vector<float>& weights) {
  const std::array<std::size_t, 3> count{std::size_t(size[0]), std::size_t(size[1]), std::size_t(size[2])};
  const std::array<std::size_t, 3> strides{1, count[0], count[0] * count[1]};
  const std::size_t width = axis == 0 ? 1 : count[0], border = weights.size() / 2 * width, length = count[axis] * width;
  const std::size_t outer = axis == 2 ? 1 : 2, lines = axis == 0 ? count[1] : 1;
  tbb::parallel_for(std::size_t(0), count[outer], [&](std::size_t i) {
    std::vector<float> line(length + 2 * border, 0.0f), sums(length);
    for (std::size_t j = 0; j < lines; ++j) {
      float* at = values.data() + i * strides[outer] + j * strides[1];
      for (std::size_t k = 0; k < count[axis]; ++k)
        std::copy_n(at + k * strides[axis], width, line.data() + border + k * width);
      std::fill(sums.begin(), sums.end(), 0.0f);
      for (std::size_t w = 0; w < weights.size(); ++w)
        for (std::size_t k = 0; k < length; ++k) sums[k] += weights[w] * line[k + w * width];
      for (std::size_t k = 0; k < count[axis]; ++k) std::copy_n(sums.data() + k * width, width, at + k * strides[axis]);
    }
  });
}

}  // namespace

Attenuation smoothed(const Attenuation& attenuation, double sigma_mm) {
  // A Gaussian leaves 3e-6 of the waves that are as long as this distance, so a sum sees none of them.
  constexpr double kSafeSpacing = 1.25;  // in standard deviations
  constexpr double kTie = 1e-9;          // the last digits of a depth in another world must not decide
  if (attenuation.is_empty() || !(sigma_mm > 0)) return attenuation;
  Attenuation result;
  result.grid = attenuation.grid;
  std::array<int, 3> reach;
  Eigen::Vector3d first;
  for (std::size_t k = 0; k < 3; ++k) {
    const double sigma = sigma_mm / attenuation.grid.spacing_mm[int(k)];
    reach[k] = int(std::ceil(3 * sigma - kTie));
    result.enough[k] = std::max(1, int(kSafeSpacing * sigma + kTie));
    result.grid.size[k] = attenuation.last[k] - attenuation.first[k] + 1 + 2 * reach[k];
    first[int(k)] = attenuation.first[k] - reach[k];
  }
  result.grid.origin_mm = attenuation.grid.point_from_index(first);
  std::vector<float> values = padded(attenuation, reach, result.grid.size);
  for (std::size_t k = 0; k < 3; ++k)
    smooth(values, result.grid.size, k, gaussian(sigma_mm / attenuation.grid.spacing_mm[int(k)], reach[k]));
  result.thousandths.resize(values.size());
  std::transform(values.begin(), values.end(), result.thousandths.begin(),
                 [](float value) { return std::int16_t(std::lround(value)); });
  find_box(result);
  return result;
}

namespace {

/// The attenuation of single voxels.
class Voxels {
 public:
  Voxels(const Volume& volume, const SignedField* field, const AttenuationOptions& options)
      : volume_(volume), field_(field), options_(options) {}

  std::int16_t at(std::size_t i) const {
    const double hu = volume_.values[i];
    if (hu < options_.below_hu || (field_ && field_->values_mm[i] > options_.margin_mm)) return 0;
    return std::int16_t(std::lround(std::clamp(hu - options_.background_hu, 0.0, 32767.0)));
  }

  /// The box of the voxels that attenuate; its last voxel is before its first one if none does.
  std::pair<std::array<int, 3>, std::array<int, 3>> box() const {
    const Grid& grid = volume_.grid;
    std::vector<std::pair<std::array<int, 3>, std::array<int, 3>>> of_slice(std::size_t(grid.size[2]),
                                                                            {grid.size, {-1, -1, -1}});
    tbb::parallel_for(0, grid.size[2], [&](int z) {
      auto& [first, last] = of_slice[std::size_t(z)];
      for (int y = 0; y < grid.size[1]; ++y)
        for (int x = 0; x < grid.size[0]; ++x) {
          if (at(grid.offset(x, y, z)) == 0) continue;
          const std::array<int, 3> here{x, y, z};
          for (std::size_t k = 0; k < 3; ++k)
            first[k] = std::min(first[k], here[k]), last[k] = std::max(last[k], here[k]);
        }
    });
    std::pair<std::array<int, 3>, std::array<int, 3>> all{grid.size, {-1, -1, -1}};
    for (const auto& [first, last] : of_slice)
      for (std::size_t k = 0; k < 3; ++k) {
        all.first[k] = std::min(all.first[k], first[k]);
        all.second[k] = std::max(all.second[k], last[k]);
      }
    return all;
  }

 private:
  const Volume& volume_;
  const SignedField* const field_;
  const AttenuationOptions& options_;
};

}  // namespace

Attenuation attenuation_of(const Volume& volume, const SignedField* field, const AttenuationOptions& options) {
  check_volume(volume, "the volume to project");
  if (field) {
    check_same_grid(field->grid, volume.grid);
    if (field->values_mm.size() != field->grid.count())
      throw Error(formatted("the field has {} values for {} voxels", field->values_mm.size(), field->grid.count()));
  }
  const Voxels voxels(volume, field, options);
  auto [first, last] = voxels.box();
  Attenuation attenuation;
  attenuation.grid = volume.grid;
  const bool is_empty = last[0] < first[0];
  if (is_empty) first = last = {0, 0, 0};  // one voxel that does not attenuate
  attenuation.first = first, attenuation.last = last;
  // With a border of empty voxels where the CT goes on: the attenuation ends between them and the last that attenuate.
  for (std::size_t k = 0; k < 3; ++k) {
    first[k] = std::max(first[k] - 1, 0);
    last[k] = std::min(last[k] + 1, volume.grid.size[k] - 1);
    attenuation.grid.size[k] = last[k] - first[k] + 1;
    attenuation.first[k] -= first[k];
    attenuation.last[k] = is_empty ? -1 : attenuation.last[k] - first[k];
  }
  attenuation.grid.origin_mm = volume.grid.point_from_index({double(first[0]), double(first[1]), double(first[2])});
  attenuation.thousandths.resize(attenuation.grid.count());
  tbb::parallel_for(0, attenuation.grid.size[2], [&](int z) {
    for (int y = 0; y < attenuation.grid.size[1]; ++y)
      for (int x = 0; x < attenuation.grid.size[0]; ++x)
        attenuation.thousandths[attenuation.grid.offset(x, y, z)] =
            voxels.at(volume.grid.offset(x + first[0], y + first[1], z + first[2]));
  });
  return attenuation;
}

}  // namespace marrow::rays
