// SPDX-License-Identifier: Apache-2.0
#include "marrow/segment/front.hpp"

#include <tbb/parallel_for.h>

#include "halo.hpp"

namespace marrow::segment {
namespace {

/// The distances of a tile's voxels from their neighbours', in rows of eight. A voxel with no neighbour within
/// `reach_mm` keeps its own. `v`: the tile's first value in its halo. `is_beside`: of each voxel, beside_surface().
MARROW_DISPATCH void redistance_tile(const float* v, const Eigen::Vector3f& per_mm, float reach_mm, float band_mm,
                                     float* values, std::uint8_t* is_beside) {
  constexpr int kSide = 8;
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y, values += kSide, is_beside += kSide) {
      const float* row = v + z * kZ + y * kY;
      for (int x = 0; x < kSide; ++x) {
        const float* at = row + x;
        const float sign = *at < 0 ? -1.f : 1.f;
        const auto nearest = [&](int step) { return std::min(sign * at[step], sign * at[-step]); };
        const float around = std::min(std::min(nearest(kX), nearest(kY)), nearest(kZ));
        const float distance = sign * std::min(eikonal(at, sign, per_mm), band_mm);
        values[x] = around < reach_mm ? distance : *at;
      }
      for (int x = 0; x < kSide; ++x) is_beside[x] = beside_surface(row + x);
    }
}

}  // namespace

Front::Front(const marrow::Grid& grid, double band_mm, const Mask& mask)
    : grid_(grid),
      band_mm_(float(band_mm)),
      near_mm_(float(std::max(grid.spacing_mm.norm() / 2 * 1.2, grid.spacing_mm.maxCoeff()))),
      reach_mm_(std::min(band_mm_, 3 * near_mm_)),
      voxels_per_mm_(grid.spacing_mm.cwiseInverse().cast<float>()) {
  inside_tile_.fill(-band_mm_);
  outside_tile_.fill(band_mm_);
  for (int k = 0; k < 3; ++k) tiles_[k] = (grid.size[k] + kTile - 1) / kTile;
  slots_.assign(std::size_t(tiles_[0]) * tiles_[1] * tiles_[2], kOutside);
  std::vector<std::uint8_t> is_mixed(slots_.size(), 0);
  tbb::parallel_for(std::size_t(0), slots_.size(), [&](std::size_t tile) {
    const Extent e = extent(tile);
    for (int k = 0; k < 3; ++k)
      if (e.first[k] + kTile < mask.first[k] || e.first[k] >= mask.first[k] + mask.size[k]) return;
    const bool inside = mask.at(e.first[0], e.first[1], e.first[2]);
    if (inside) slots_[tile] = kInside;
    // One voxel beyond the tile, so that a surface between two tiles is seen.
    for (int z = e.first[2]; z < std::min(e.first[2] + kTile + 1, grid_.size[2]); ++z)
      for (int y = e.first[1]; y < std::min(e.first[1] + kTile + 1, grid_.size[1]); ++y)
        for (int x = e.first[0]; x < std::min(e.first[0] + kTile + 1, grid_.size[0]); ++x)
          is_mixed[tile] |= mask.at(x, y, z) != inside;
  });
  for (std::size_t tile = 0; tile < slots_.size(); ++tile)
    if (is_mixed[tile]) {
      provide(tile);
      is_awake_[std::size_t(slots_[tile])] = 1;
    }
  choose_active();
  const float half_voxel_mm = 0.5f * float(grid.spacing_mm.minCoeff());
  for (const std::uint32_t tile : active_) {
    const Extent e = extent(tile);
    float* values = values_mm_.data() + std::size_t(slots_[tile]) * kVoxels;
    for (int z = 0; z < e.size[2]; ++z)
      for (int y = 0; y < e.size[1]; ++y)
        for (int x = 0; x < e.size[0]; ++x)
          values[(z * kTile + y) * kTile + x] =
              mask.at(e.first[0] + x, e.first[1] + y, e.first[2] + z) ? -band_mm_ : band_mm_;
  }
  for (float& value : values_mm_) value = value < 0 ? -half_voxel_mm : half_voxel_mm;
  for (int pass = 0; pass < 3; ++pass) redistance_once(false, reach_mm_);
  values_before_ = values_mm_;
}

Front::Extent Front::extent(std::size_t tile) const {
  const auto t = place_of(tile);
  Extent extent;
  for (int k = 0; k < 3; ++k) {
    extent.first[k] = t[k] * kTile;
    extent.size[k] = std::min(kTile, grid_.size[k] - t[k] * kTile);
  }
  return extent;
}

/// Gives a tile memory.
void Front::provide(std::size_t tile) {
  if (slots_[tile] >= 0) return;
  const float value = slots_[tile] == kInside ? -band_mm_ : band_mm_;
  slots_[tile] = std::int32_t(tile_in_slot_.size());
  tile_in_slot_.push_back(std::uint32_t(tile));
  is_awake_.push_back(0);
  values_mm_.resize(values_mm_.size() + kVoxels, value);
  values_before_.resize(values_mm_.size(), value);
  speed_.resize(values_mm_.size(), 0.f);
  shift_mm_.resize(values_mm_.size(), 0.f);
}

/// Copies a tile's values and one voxel around it. Outside the grid the border's values are repeated. Returns whether
/// any of them is nearer to the surface than `reach_mm`.
bool Front::load(std::size_t tile, float reach_mm, Halo& halo) const {
  const auto t = place_of(tile);
  // For each axis and each place in the halo: the tile (before, this, after) and the place in that tile.
  std::array<std::array<int, kHalo>, 3> of_tile, local;
  int last[3];
  for (int k = 0; k < 3; ++k) {
    last[k] = std::min(kTile, grid_.size[k] - t[k] * kTile) + 1;
    for (int i = 0; i <= last[k]; ++i) {
      const int index = std::clamp(t[k] * kTile + i - 1, 0, grid_.size[k] - 1);
      of_tile[k][i] = index / kTile - t[k] + 1;
      local[k][i] = index % kTile;
    }
  }
  for (int z = 0; z <= last[2]; ++z)
    for (int y = 0; y <= last[1]; ++y) {
      const std::size_t tiles_row = tile_of(t[0], t[1] + of_tile[1][y] - 1, t[2] + of_tile[2][z] - 1) - 1,
                        local_row = std::size_t(local[2][z] * kTile + local[1][y]) * kTile;
      const auto row_in = [&](int x) { return values_of(tiles_row + std::size_t(of_tile[0][x])) + local_row; };
      float* out = halo.data() + z * kZ + y * kY;
      std::copy_n(row_in(1), kTile, out + 1);
      out[0] = row_in(0)[local[0][0]];
      out[last[0]] = row_in(last[0])[local[0][last[0]]];
    }
  int near = 0;
  for (const float value : halo) near |= std::abs(value) < reach_mm;
  return near != 0;
}

/// Calls visit(pointer to the value in a halo, x, y, z, place in next_values_, place in the tiles' memory) for each
/// voxel of an active tile, unless all of them and their neighbours are at least `reach_mm` from the surface.
template <class Visit>
void Front::for_voxels(std::size_t position, float reach_mm, const Visit& visit) {
  const std::size_t tile = active_[position], slot = std::size_t(slots_[tile]);
  const Extent e = extent(tile);
  Halo halo{};
  if (!load(tile, reach_mm, halo)) return;
  for (int z = 0; z < e.size[2]; ++z)
    for (int y = 0; y < e.size[1]; ++y)
      for (int x = 0; x < e.size[0]; ++x) {
        const std::size_t local = std::size_t(z * kTile + y) * kTile + std::size_t(x);
        visit(halo.data() + (z + 1) * kZ + (y + 1) * kY + x + 1, e.first[0] + x, e.first[1] + y, e.first[2] + z,
              position * kVoxels + local, slot * kVoxels + local);
      }
}

void Front::keep_values(std::size_t position) {
  std::copy_n(values_of(active_[position]), kVoxels, next_values_.data() + position * kVoxels);
}

void Front::write_back() {
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    const std::size_t slot = std::size_t(slots_[active_[position]]);
    std::copy_n(next_values_.data() + position * kVoxels, kVoxels, values_mm_.data() + slot * kVoxels);
  });
}

void Front::hold_far_from(const std::vector<const Front*>& others, double distance_mm) {
  may_move_.assign(slots_.size(), 0);
  for (const Front* other : others)
    for (std::size_t tile = 0; tile < slots_.size(); ++tile) may_move_[tile] |= other->slots_[tile] >= 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int reach = int(std::ceil(distance_mm / (kTile * grid_.spacing_mm[axis])));
    const std::vector<std::uint8_t> before = may_move_;
    for (std::size_t tile = 0; tile < slots_.size(); ++tile) {
      if (!before[tile]) continue;
      auto place = place_of(tile);
      const int from = std::max(0, place[axis] - reach), to = std::min(tiles_[axis] - 1, place[axis] + reach);
      for (place[axis] = from; place[axis] <= to; ++place[axis]) may_move_[tile_of(place[0], place[1], place[2])] = 1;
    }
  }
  choose_active();
}

/// The active tiles are those that are awake and their six neighbours, if they may move. All of them get memory.
void Front::choose_active() {
  std::vector<std::uint32_t> chosen;
  for (std::size_t slot = 0; slot < is_awake_.size(); ++slot) {
    if (!is_awake_[slot]) continue;
    const auto t = place_of(tile_in_slot_[slot]);
    const auto choose = [&](int i, int j, int k) {
      if (i < 0 || j < 0 || k < 0 || i >= tiles_[0] || j >= tiles_[1] || k >= tiles_[2]) return;
      const std::size_t tile = tile_of(i, j, k);
      if (may_move_.empty() || may_move_[tile]) chosen.push_back(std::uint32_t(tile));
    };
    choose(t[0], t[1], t[2]);
    for (int side : {-1, 1}) {
      choose(t[0] + side, t[1], t[2]);
      choose(t[0], t[1] + side, t[2]);
      choose(t[0], t[1], t[2] + side);
    }
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  for (const std::uint32_t tile : chosen) provide(tile);
  active_ = std::move(chosen);
  next_values_.resize(active_.size() * kVoxels);
}

void Front::find_thin_cortex(const marrow::Volume& volume, const EdgeProfile& profile) {
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    for_voxels(position, near_mm_, [&](const float* v, int x, int y, int z, std::size_t, std::size_t at) {
      if (std::abs(*v) > near_mm_) return;
      const Eigen::Vector3f g = gradient(v, voxels_per_mm_);
      const float length = g.norm();
      if (length < 0.1f) return;
      const Eigen::Vector3f normal_index = (g / length).cwiseProduct(voxels_per_mm_);
      shift_mm_[at] =
          float(profile.thin_cortex_shift_mm(volume, Eigen::Vector3f(x, y, z) - *v * normal_index, normal_index));
    });
  });
}

void Front::evaluate(const marrow::Volume& volume, const EdgeProfile& profile, const Force& force) {
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    for_voxels(position, near_mm_, [&](const float* v, int x, int y, int z, std::size_t, std::size_t at) {
      if (std::abs(*v) > near_mm_) return;
      const Eigen::Vector3f g = gradient(v, voxels_per_mm_);
      const float length = g.norm();
      float& speed = speed_[at];
      speed = 0;
      if (length < 0.1f) return;
      const Eigen::Vector3f normal_index = (g / length).cwiseProduct(voxels_per_mm_);
      const Edge edge = profile.at(volume, Eigen::Vector3f(x, y, z) - *v * normal_index, normal_index);
      const double ratio = std::max(0.0, edge.drop_hu) / force.edge_hu, open = 1 / (1 + ratio * ratio);
      const double bone = std::clamp((edge.mean_hu - force.floor_hu) / 50, -1.0, 1.0);
      const double towards_edge = std::clamp(-(edge.offset_mm + shift_mm_[at]) / grid_.spacing_mm[0], -1.0, 1.0);
      const double bend = std::clamp(double(curvature(v, voxels_per_mm_, g)), -2.0, 2.0);
      speed = float(force.advection * bone * open + towards_edge * (1 - open) - force.curvature_mm * bend);
    });
  });
}

void Front::advance(double step_mm) {
  // Only these voxels move. redistance() computes the distances around them.
  const float moving_mm = std::min(band_mm_, 2 * near_mm_);
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    keep_values(position);
    for_voxels(position, moving_mm, [&](const float* v, int x, int y, int z, std::size_t place, std::size_t) {
      if (std::abs(*v) >= moving_mm) return;
      const Eigen::Vector3f g = gradient(v, voxels_per_mm_);
      const float length = g.norm();
      if (length < 0.1f) return;
      // A voxel of the band has the speed of the closest point of the surface.
      const Eigen::Vector3f closest = Eigen::Vector3f(x, y, z) - *v / length * g.cwiseProduct(voxels_per_mm_);
      int nearest[3];
      for (int k = 0; k < 3; ++k) nearest[k] = std::clamp(int(closest[k] + 0.5f), 0, grid_.size[k] - 1);
      const std::int32_t slot = slots_[tile_of(nearest[0] / kTile, nearest[1] / kTile, nearest[2] / kTile)];
      if (slot < 0) return;
      const float speed =
          speed_[std::size_t(slot) * kVoxels + std::size_t((nearest[2] % kTile) * kTile + nearest[1] % kTile) * kTile +
                 std::size_t(nearest[0] % kTile)];
      const float moved = *v - float(step_mm) * speed * upwind_gradient(v, voxels_per_mm_, speed);
      next_values_[place] = std::clamp(moved, -band_mm_, band_mm_);
    });
  });
  write_back();
}

void Front::redistance_once(bool rescale, float reach_mm) {
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    keep_values(position);
    Halo halo{};
    if (!load(active_[position], reach_mm, halo)) return;
    float* next = next_values_.data() + position * kVoxels;
    std::array<std::uint8_t, kVoxels> is_beside;
    const float* first = halo.data() + kZ + kY + kX;
    redistance_tile(first, voxels_per_mm_, reach_mm, band_mm_, next, is_beside.data());
    for (std::size_t i = 0; i < kVoxels; ++i) {
      if (!is_beside[i]) continue;
      const float* v = first + i / (kTile * kTile) * kZ + i / kTile % kTile * kY + i % kTile;
      const float length = rescale ? gradient(v, voxels_per_mm_).norm() : 0.f;
      const float rescaled = length > 0.3f ? *v / std::clamp(length, 0.7f, 1.4f) : *v;
      next[i] = std::clamp(rescaled, -near_mm_, near_mm_);  // a neighbour of the surface is no farther
    }
  });
  write_back();
}

void Front::redistance() {
  redistance_once(true, reach_mm_);
  redistance_once(false, reach_mm_);
}

void Front::finish() {
  active_ = tile_in_slot_;
  std::sort(active_.begin(), active_.end());
  next_values_.resize(active_.size() * kVoxels);
  const int passes = int(std::ceil((band_mm_ - reach_mm_) * voxels_per_mm_.maxCoeff())) + 2;
  for (int pass = 0; pass < passes; ++pass) redistance_once(false, band_mm_);
}

std::vector<float> Front::values_mm() const {
  std::vector<float> values(grid_.count());
  tbb::parallel_for(0, grid_.size[2], [&](int z) {
    for (int y = 0; y < grid_.size[1]; ++y)
      for (int x = 0; x < grid_.size[0]; x += kTile) {
        const std::int32_t slot = slots_[tile_of(x / kTile, y / kTile, z / kTile)];
        float* out = values.data() + grid_.offset(x, y, z);
        const int count = std::min(kTile, grid_.size[0] - x);
        if (slot < 0)
          std::fill_n(out, count, slot == kInside ? -band_mm_ : band_mm_);
        else
          std::copy_n(
              values_mm_.data() + std::size_t(slot) * kVoxels + std::size_t((z % kTile) * kTile + y % kTile) * kTile,
              count, out);
      }
  });
  return values;
}

bool Front::has_vanished() const {
  return std::none_of(slots_.begin(), slots_.end(), [](std::int32_t slot) { return slot == kInside; }) &&
         std::none_of(values_mm_.begin(), values_mm_.end(), [](float value) { return value < 0; });
}

bool Front::rest(double least_motion_mm) {
  struct Tally {
    double motion_mm = 0;
    std::size_t surface = 0, band = 0;
  };
  std::vector<Tally> tallies(active_.size());
  tbb::parallel_for(std::size_t(0), active_.size(), [&](std::size_t position) {
    Tally& tally = tallies[position];
    for_voxels(position, reach_mm_, [&](const float* v, int, int, int, std::size_t, std::size_t at) {
      float& before = values_before_[at];
      tally.band += std::abs(*v) < band_mm_;
      if (beside_surface(v)) {
        tally.motion_mm += std::abs(*v - before);
        ++tally.surface;
      }
      before = *v;
    });
    is_awake_[std::size_t(slots_[active_[position]])] = tally.motion_mm > least_motion_mm * double(tally.surface);
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
  tbb::parallel_for(std::size_t(0), a.active_.size(), [&](std::size_t position) {
    const std::size_t tile = a.active_[position];
    if (b.slots_[tile] < 0) return;
    float* of_a = a.values_mm_.data() + std::size_t(a.slots_[tile]) * kVoxels;
    float* of_b = b.values_mm_.data() + std::size_t(b.slots_[tile]) * kVoxels;
    for (std::size_t i = 0; i < kVoxels; ++i) {
      const float overlap = std::min(0.f, 0.5f * (of_a[i] + of_b[i]));
      of_a[i] -= overlap;
      of_b[i] -= overlap;
    }
  });
}

}  // namespace marrow::segment
