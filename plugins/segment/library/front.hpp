// SPDX-License-Identifier: Apache-2.0
#pragma once
// A moving surface: a signed distance that is kept only in a narrow band around its zero level (Adalsteinsson and
// Sethian, A fast level set method for propagating interfaces, J. Comput. Phys. 1995). The grid is divided into tiles
// of 8 x 8 x 8 voxels. Only tiles near the surface have memory. Only tiles near a moving part of the surface are
// visited. So memory grows with the area of the surface, and the time of a step with the area that moves.
#include <array>
#include <cstdint>
#include <vector>

#include "marrow/segment/edge_profile.hpp"
#include "marrow/segment/fragments.hpp"

namespace marrow::segment {

/// Speed along the outward normal: F = advection g + edge (1 - g) - curvature kappa. This follows the chapter's Eq 6 as
/// corrected in docs/method.md, with two changes. The curvature term is not multiplied by g. The term `edge` draws the
/// front back to the edge in the image: without it the front would leak through, because g is small there but never 0.
struct Force {
  double advection = 1;       ///< F0; a positive value expands the surface
  double curvature_mm = 0.1;  ///< epsilon
  double edge_hu = 150;       ///< K in g = 1 / (1 + (drop / K)^2)
  double floor_hu = 150;      ///< the advection changes its sign where the CT is below this, which prevents leaks
};

class Front {
 public:
  /// Starts at the surface of a mask.
  Front(const marrow::Grid& grid, double band_mm, const Mask& mask);

  /// From now on, parts of this surface stay where they are if they are farther than about `distance_mm` from the
  /// surfaces of all `others`, as these are now. All fronts are on the same grid.
  void hold_far_from(const std::vector<const Front*>& others, double distance_mm);

  /// Finds by how much a thin cortex shifts the edges near the surface. Later calls of evaluate() use this.
  void find_thin_cortex(const marrow::Volume& volume, const EdgeProfile& profile);
  /// First half of a time step: computes the speed of the surface.
  void evaluate(const marrow::Volume& volume, const EdgeProfile& profile, const Force& force);
  /// Second half of a time step: moves the surface by speed * `step_mm`.
  void advance(double step_mm);
  /// Turns the values near moving parts into distances again, and moves the band along with the front.
  void redistance();
  /// The stop rule, tile by tile. A tile goes to sleep if its surface moved by at most `least_motion_mm` on average
  /// since the last call. The neighbours of a tile that still moves are visited again. True if no tile moves.
  bool rest(double least_motion_mm);
  /// Computes the distances in the whole band. The surface does not move.
  void finish();
  /// The field on the whole grid.
  std::vector<float> values_mm() const;

  /// Where two fronts on the same grid overlap, each gives up half of the overlap. For use between time steps.
  static void keep_apart(Front& a, Front& b);

  /// Mean motion of the visited parts of the surface between the last two calls of rest().
  double mean_motion_mm() const { return mean_motion_mm_; }
  std::size_t band_voxels() const { return band_voxels_; }
  /// Whether no voxel is inside any more.
  bool has_vanished() const;

 private:
  static constexpr int kTile = 8, kHalo = kTile + 2;
  static constexpr std::size_t kVoxels = std::size_t(kTile) * kTile * kTile;
  static constexpr std::int32_t kOutside = -1, kInside = -2;  // tiles without memory
  using Halo = std::array<float, kHalo * kHalo * kHalo>;
  struct Extent {
    int first[3], size[3];
  };

  std::size_t tile_of(int x, int y, int z) const { return (std::size_t(z) * tiles_[1] + y) * tiles_[0] + x; }
  std::array<int, 3> place_of(std::size_t tile) const {
    return {int(tile % tiles_[0]), int(tile / tiles_[0] % tiles_[1]), int(tile / tiles_[0] / tiles_[1])};
  }
  Extent extent(std::size_t tile) const;
  const float* values_of(std::size_t tile) const {
    const std::int32_t slot = slots_[tile];
    return slot >= 0         ? values_mm_.data() + std::size_t(slot) * kVoxels
           : slot == kInside ? inside_tile_.data()
                             : outside_tile_.data();
  }
  bool load(std::size_t tile, float reach_mm, Halo& halo) const;
  void provide(std::size_t tile);
  void choose_active();
  template <class Visit>
  void for_voxels(std::size_t position, float reach_mm, const Visit& visit);
  void keep_values(std::size_t position);
  void write_back();
  void redistance_once(bool rescale, float reach_mm);

  marrow::Grid grid_;
  float band_mm_, near_mm_, reach_mm_;
  Eigen::Vector3f voxels_per_mm_;
  std::array<int, 3> tiles_;
  std::array<float, kVoxels> inside_tile_, outside_tile_;  // the values of all tiles without memory
  std::vector<std::int32_t> slots_;  // for each tile: its place in the arrays below, or kOutside or kInside
  std::vector<std::uint32_t> tile_in_slot_;
  std::vector<float> values_mm_, values_before_, speed_, shift_mm_;
  std::vector<std::uint8_t> is_awake_;  // of each slot
  std::vector<std::uint8_t> may_move_;  // of each tile; empty: all
  std::vector<std::uint32_t> active_;   // tiles visited in this step, in order
  std::vector<float> next_values_;      // of the active tiles
  double mean_motion_mm_ = 0;
  std::size_t band_voxels_ = 0;
};

}  // namespace marrow::segment
