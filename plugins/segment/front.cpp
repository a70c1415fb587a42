// SPDX-License-Identifier: Apache-2.0
#include "front.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace level_set {
namespace {

constexpr int kX = 1, kY = 10, kZ = 100;  // neighbours within a halo

/// Gradient by central differences, per mm, in the grid's own axes.
Eigen::Vector3f gradient(const float* v, const Eigen::Vector3f& per_mm) {
  return Eigen::Vector3f(v[kX] - v[-kX], v[kY] - v[-kY], v[kZ] - v[-kZ]).cwiseProduct(0.5f * per_mm);
}

/// div(grad / |grad|), per mm; positive for a ball.
float curvature(const float* v, const Eigen::Vector3f& per_mm, const Eigen::Vector3f& g) {
  const auto second = [&](int s, int k) { return (v[s] - 2 * v[0] + v[-s]) * per_mm[k] * per_mm[k]; };
  const auto mixed = [&](int s, int t, int k, int l) {
    return (v[s + t] - v[s - t] - v[t - s] + v[-s - t]) * 0.25f * per_mm[k] * per_mm[l];
  };
  const float xx = second(kX, 0), yy = second(kY, 1), zz = second(kZ, 2);
  const float squared = g.squaredNorm();
  const float numerator = xx * (g.y() * g.y() + g.z() * g.z()) + yy * (g.x() * g.x() + g.z() * g.z()) +
                          zz * (g.x() * g.x() + g.y() * g.y()) -
                          2 * (g.x() * g.y() * mixed(kX, kY, 0, 1) + g.x() * g.z() * mixed(kX, kZ, 0, 2) +
                               g.y() * g.z() * mixed(kY, kZ, 1, 2));
  return numerator / (squared * std::sqrt(squared));
}

/// |grad| by Godunov's upwind differences for a front that moves with the sign of `speed`.
float upwind_gradient(const float* v, const Eigen::Vector3f& per_mm, float speed) {
  float sum = 0;
  const int steps[3] = {kX, kY, kZ};
  for (int k = 0; k < 3; ++k) {
    const float back = (v[0] - v[-steps[k]]) * per_mm[k], ahead = (v[steps[k]] - v[0]) * per_mm[k];
    const float first = speed > 0 ? std::max(back, 0.f) : std::min(back, 0.f);
    const float second = speed > 0 ? std::min(ahead, 0.f) : std::max(ahead, 0.f);
    sum += first * first + second * second;
  }
  return std::sqrt(sum);
}

/// Smallest solution of |grad u| = 1 given the neighbours' distances (Rouy and Tourin, SIAM J. Numer. Anal. 1992).
float eikonal(const float* v, float sign, const Eigen::Vector3f& per_mm) {
  std::array<std::pair<float, float>, 3> neighbours;  // distance, 1 / spacing^2
  const int steps[3] = {kX, kY, kZ};
  for (int k = 0; k < 3; ++k)
    neighbours[k] = {std::max(0.f, std::min(sign * v[steps[k]], sign * v[-steps[k]])), per_mm[k] * per_mm[k]};
  std::sort(neighbours.begin(), neighbours.end());
  float a = 0, b = 0, c = -1, distance = 0;
  for (int k = 0; k < 3; ++k) {
    if (k && distance <= neighbours[k].first) break;
    a += neighbours[k].second;
    b += neighbours[k].second * neighbours[k].first;
    c += neighbours[k].second * neighbours[k].first * neighbours[k].first;
    distance = (b + std::sqrt(std::max(0.f, b * b - a * c))) / a;
  }
  return distance;
}

bool beside_surface(const float* v) {
  for (int step : {kX, -kX, kY, -kY, kZ, -kZ})
    if ((v[step] < 0) != (v[0] < 0)) return true;
  return false;
}

bool beyond_band(const float* v, float band) {
  return v[kX] == band && v[-kX] == band && v[kY] == band && v[-kY] == band && v[kZ] == band && v[-kZ] == band;
}

}  // namespace

Front::Front(const marrow::Grid& grid, double band_mm)
    : grid_(grid),
      band_mm_(float(band_mm)),
      near_mm_(float(std::max(grid.spacing_mm.norm() / 2 * 1.2, grid.spacing_mm.maxCoeff()))),
      voxels_per_mm_(grid.spacing_mm.cwiseInverse().cast<float>()),
      values_mm_(grid.count(), float(band_mm)),
      values_before_(values_mm_),
      speed_(grid.count(), 0.f) {
  for (int k = 0; k < 3; ++k) tiles_[k] = (grid.size[k] + kTile - 1) / kTile;
  is_active_.assign(tile_count(), 0);
  is_awake_.assign(tile_count(), 0);
}

void Front::add_ball(const Eigen::Vector3d& centre_index, double radius_mm) {
  const double reach_mm = radius_mm + band_mm_;
  int low[3], high[3];
  for (int k = 0; k < 3; ++k) {
    low[k] = std::max(0, int(std::floor(centre_index[k] - reach_mm / grid_.spacing_mm[k])));
    high[k] = std::min(grid_.size[k] - 1, int(std::ceil(centre_index[k] + reach_mm / grid_.spacing_mm[k])));
  }
  for (int z = low[2]; z <= high[2]; ++z)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) {
        const Eigen::Vector3d away = (Eigen::Vector3d(x, y, z) - centre_index).cwiseProduct(grid_.spacing_mm);
        float& value = values_mm_[grid_.offset(x, y, z)];
        value = std::min(value, float(away.norm() - radius_mm));
      }
}

Front::Extent Front::extent(std::size_t tile) const {
  const int t[3] = {int(tile % tiles_[0]), int(tile / tiles_[0] % tiles_[1]), int(tile / tiles_[0] / tiles_[1])};
  Extent extent;
  for (int k = 0; k < 3; ++k) {
    extent.first[k] = t[k] * kTile;
    extent.size[k] = std::min(kTile, grid_.size[k] - t[k] * kTile);
  }
  return extent;
}

void Front::load(const Extent& extent, Halo& halo) const {
  for (int z = 0; z < extent.size[2] + 2; ++z)
    for (int y = 0; y < extent.size[1] + 2; ++y) {
      const float* row = values_mm_.data() + grid_.offset(0, std::clamp(extent.first[1] + y - 1, 0, grid_.size[1] - 1),
                                                          std::clamp(extent.first[2] + z - 1, 0, grid_.size[2] - 1));
      float* out = halo.data() + z * kZ + y * kY;
      std::copy_n(row + extent.first[0], extent.size[0], out + 1);
      out[0] = row[std::max(extent.first[0] - 1, 0)];
      out[extent.size[0] + 1] = row[std::min(extent.first[0] + extent.size[0], grid_.size[0] - 1)];
    }
}

/// Calls visit(value and its neighbours, x, y, z, place in next_values_) for each voxel of an active tile.
template <class Visit>
void Front::for_voxels(std::size_t position, const Visit& visit) {
  const Extent e = extent(active_[position]);
  Halo halo;
  load(e, halo);
  for (int z = 0; z < e.size[2]; ++z)
    for (int y = 0; y < e.size[1]; ++y)
      for (int x = 0; x < e.size[0]; ++x)
        visit(halo.data() + (z + 1) * kZ + (y + 1) * kY + x + 1, e.first[0] + x, e.first[1] + y, e.first[2] + z,
              position * kTile * kTile * kTile + std::size_t(z * kTile + y) * kTile + x);
}

void Front::write_back() {
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    const Extent e = extent(active_[position]);
    for (int z = 0; z < e.size[2]; ++z)
      for (int y = 0; y < e.size[1]; ++y)
        std::copy_n(next_values_.data() + position * kTile * kTile * kTile + std::size_t(z * kTile + y) * kTile,
                    e.size[0], values_mm_.data() + grid_.offset(e.first[0], e.first[1] + y, e.first[2] + z));
  });
}

void Front::wake_all() {
  tbb::parallel_for(std::size_t(0), tile_count(), [&](std::size_t tile) {
    const Extent e = extent(tile);
    const bool inside = values_mm_[grid_.offset(e.first[0], e.first[1], e.first[2])] < 0;
    is_awake_[tile] = 0;
    // One voxel beyond the tile, so that a surface between two tiles wakes both.
    for (int z = e.first[2]; z < std::min(e.first[2] + kTile + 1, grid_.size[2]); ++z)
      for (int y = e.first[1]; y < std::min(e.first[1] + kTile + 1, grid_.size[1]); ++y)
        for (int x = e.first[0]; x < std::min(e.first[0] + kTile + 1, grid_.size[0]); ++x)
          is_awake_[tile] |= (values_mm_[grid_.offset(x, y, z)] < 0) != inside;
  });
  choose_active();
}

void Front::choose_active() {
  std::fill(is_active_.begin(), is_active_.end(), std::uint8_t(0));
  for (int z = 0; z < tiles_[2]; ++z)
    for (int y = 0; y < tiles_[1]; ++y)
      for (int x = 0; x < tiles_[0]; ++x) {
        if (!is_awake_[(std::size_t(z) * tiles_[1] + y) * tiles_[0] + x]) continue;
        const auto choose = [&](int i, int j, int k) {
          if (i >= 0 && j >= 0 && k >= 0 && i < tiles_[0] && j < tiles_[1] && k < tiles_[2])
            is_active_[(std::size_t(k) * tiles_[1] + j) * tiles_[0] + i] = 1;
        };
        choose(x, y, z);
        for (int side : {-1, 1}) {
          choose(x + side, y, z);
          choose(x, y + side, z);
          choose(x, y, z + side);
        }
      }
  active_.clear();
  for (std::size_t tile = 0; tile < tile_count(); ++tile)
    if (is_active_[tile]) active_.push_back(std::uint32_t(tile));
  next_values_.resize(active_.size() * kTile * kTile * kTile);
}

void Front::evaluate(const marrow::Volume& volume, const EdgeProfile& profile, const Force& force) {
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    for_voxels(position, [&](const float* v, int x, int y, int z, std::size_t) {
      if (std::abs(*v) > near_mm_) return;
      const Eigen::Vector3f g = gradient(v, voxels_per_mm_);
      const float length = g.norm();
      float& speed = speed_[grid_.offset(x, y, z)];
      speed = 0;
      if (length < 0.1f) return;
      const Eigen::Vector3f normal_index = (g / length).cwiseProduct(voxels_per_mm_);
      const Edge edge = profile.at(volume, Eigen::Vector3f(x, y, z) - *v * normal_index, normal_index);
      const double ratio = std::max(0.0, edge.drop_hu) / force.edge_hu, open = 1 / (1 + ratio * ratio);
      const double bone = std::clamp((edge.mean_hu - force.floor_hu) / 50, -1.0, 1.0);
      const double towards_edge = std::clamp(-edge.offset_mm / grid_.spacing_mm[0], -1.0, 1.0);
      const double bend = std::clamp(double(curvature(v, voxels_per_mm_, g)), -2.0, 2.0);
      speed = float(force.advection * bone * open + towards_edge * (1 - open) - force.curvature_mm * bend);
    });
  });
}

void Front::advance(double step_mm) {
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    for_voxels(position, [&](const float* v, int x, int y, int z, std::size_t place) {
      next_values_[place] = *v;
      if (std::abs(*v) >= band_mm_) return;
      const Eigen::Vector3f g = gradient(v, voxels_per_mm_);
      const float length = g.norm();
      if (length < 0.1f) return;
      // The speed of the band is that of the closest point of the surface.
      const Eigen::Vector3f closest = Eigen::Vector3f(x, y, z) - *v / length * g.cwiseProduct(voxels_per_mm_);
      int nearest[3];
      for (int k = 0; k < 3; ++k) nearest[k] = std::clamp(int(closest[k] + 0.5f), 0, grid_.size[k] - 1);
      const float speed = speed_[grid_.offset(nearest[0], nearest[1], nearest[2])];
      const float moved = *v - float(step_mm) * speed * upwind_gradient(v, voxels_per_mm_, speed);
      next_values_[place] = std::clamp(moved, -band_mm_, band_mm_);
    });
  });
  write_back();
}

void Front::redistance() {
  for (int pass = 0; pass < 2; ++pass) {
    tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
      for_voxels(position, [&](const float* v, int, int, int, std::size_t place) {
        const float sign = *v < 0 ? -1.f : 1.f;
        if (beside_surface(v)) {
          const float length = gradient(v, voxels_per_mm_).norm();
          const float rescaled = pass == 0 && length > 0.3f ? *v / std::clamp(length, 0.7f, 1.4f) : *v;
          next_values_[place] = std::clamp(rescaled, -near_mm_, near_mm_);  // no voxel beside it is farther
        } else if (beyond_band(v, sign * band_mm_)) {
          next_values_[place] = sign * band_mm_;
        } else {
          next_values_[place] = sign * std::min(eikonal(v, sign, voxels_per_mm_), band_mm_);
        }
      });
    });
    write_back();
  }
}

bool Front::rest(double least_motion_mm) {
  struct Tally {
    double motion_mm = 0;
    std::size_t surface = 0, band = 0;
  };
  std::vector<Tally> tallies(active_.size());
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    Tally& tally = tallies[position];
    for_voxels(position, [&](const float* v, int x, int y, int z, std::size_t) {
      float& before = values_before_[grid_.offset(x, y, z)];
      tally.band += std::abs(*v) < band_mm_;
      if (beside_surface(v)) {
        tally.motion_mm += std::abs(*v - before);
        ++tally.surface;
      }
      before = *v;
    });
    is_awake_[active_[position]] = tally.motion_mm > least_motion_mm * double(tally.surface);
  });
  Tally sum;
  for (const Tally& tally : tallies) {
    sum.motion_mm += tally.motion_mm;
    sum.surface += tally.surface;
    sum.band += tally.band;
  }
  mean_motion_mm_ = sum.surface ? sum.motion_mm / double(sum.surface) : 0;
  band_voxels_ = sum.band;
  choose_active();
  return active_.empty();
}

void Front::keep_apart(Front& a, Front& b) {
  tbb::parallel_for(std::size_t(0), a.tile_count(), [&](std::size_t tile) {
    if (!a.is_active_[tile] && !b.is_active_[tile]) return;
    const Extent e = a.extent(tile);
    for (int z = 0; z < e.size[2]; ++z)
      for (int y = 0; y < e.size[1]; ++y)
        for (int x = 0; x < e.size[0]; ++x) {
          const std::size_t at = a.grid_.offset(e.first[0] + x, e.first[1] + y, e.first[2] + z);
          const float overlap = std::min(0.f, 0.5f * (a.values_mm_[at] + b.values_mm_[at]));
          a.values_mm_[at] -= overlap;
          b.values_mm_[at] -= overlap;
        }
  });
}

}  // namespace level_set
