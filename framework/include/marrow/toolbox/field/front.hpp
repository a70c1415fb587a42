// SPDX-License-Identifier: Apache-2.0
#pragma once
// A moving surface: a signed distance, kept in a narrow band around its zero level only (Adalsteinsson and Sethian, A
// fast level set method for propagating interfaces, J. Comput. Phys. 1995). The grid is divided in tiles of 8 x 8 x 8
// voxels; only tiles near the surface have memory, and only those near a part of it that still moves are visited:
// memory grows with the surface, the time of a step with what moves.
#include <array>
#include <cstdint>
#include <vector>

#include "marrow/toolbox/field/edge_profile.hpp"
#include "marrow/toolbox/field/fragments.hpp"

namespace marrow::field {

/// F = advection g + edge (1 - g) - curvature kappa: Eq 6 of the chapter in its corrected reading, with the image force
/// also drawing the front back to the edge, which keeps it from leaking through where g is small but never zero.
struct Force {
  double advection = 1;       ///< F0, positive expands
  double curvature_mm = 0.1;  ///< epsilon
  double edge_hu = 150;       ///< K in g = 1 / (1 + (drop / K)^2)
  double floor_hu = 150;      ///< leak guard: the advection turns around where the CT is below it
};

class Front {
 public:
  /// The surface of a mask.
  Front(const marrow::Grid& grid, double band_mm, const Mask& mask);

  /// What thin cortex does to the edges near the surface, for the steps that follow.
  void find_thin_cortex(const marrow::Volume& volume, const EdgeProfile& profile);
  /// One time step in two halves, so that fronts can be kept apart between steps.
  void evaluate(const marrow::Volume& volume, const EdgeProfile& profile, const Force& force);
  void advance(double step_mm);
  /// Makes the values distances again around what moves, and lets the band follow the front.
  void redistance();
  /// The stop rule: what moved less on average, per tile and since the last call, goes to sleep, and what borders on
  /// something that moves wakes up. True when all is at rest.
  bool rest(double least_motion_mm);
  /// Distances in the whole band; the surface stays where it is.
  void finish();
  /// The field on the whole grid.
  std::vector<float> values_mm() const;

  static void keep_apart(Front& a, Front& b);

  /// Of the moving parts of the surface, between the last two calls of rest().
  double mean_motion_mm() const { return mean_motion_mm_; }
  std::size_t band_voxels() const { return band_voxels_; }
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
  void load(std::size_t tile, Halo& halo) const;
  void provide(std::size_t tile);
  void choose_active();
  template <class Visit>
  void for_voxels(std::size_t position, const Visit& visit);
  void write_back();
  void redistance_once(bool rescale);

  marrow::Grid grid_;
  float band_mm_, near_mm_;
  Eigen::Vector3f voxels_per_mm_;
  std::array<int, 3> tiles_;
  std::vector<std::int32_t> slots_;  // of each tile: where its voxels lie in the arrays below, or what the tile is
  std::vector<std::uint32_t> tile_in_slot_;
  std::vector<float> values_mm_, values_before_, speed_, shift_mm_;
  std::vector<std::uint8_t> is_awake_;  // of each slot
  std::vector<std::uint32_t> active_;   // tiles visited in this step, in order
  std::vector<float> next_values_;      // of the active tiles
  double mean_motion_mm_ = 0;
  std::size_t band_voxels_ = 0;
};

}  // namespace marrow::field
