// SPDX-License-Identifier: Apache-2.0
#pragma once
// A moving surface: a signed distance, kept in a narrow band around its zero level only (Adalsteinsson and Sethian, A
// fast level set method for propagating interfaces, J. Comput. Phys. 1995). The grid is divided in tiles of 8 x 8 x 8
// voxels; only tiles near a part of the surface that still moves are visited, so a step costs what moves, not what the
// volume holds.
#include <array>
#include <cstdint>
#include <vector>

#include "edge_profile.hpp"

namespace level_set {

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
  Front(const marrow::Grid& grid, double band_mm);

  void add_ball(const Eigen::Vector3d& centre_index, double radius_mm);
  /// Wakes all tiles near the zero level.
  void wake_all();

  /// One time step in two halves, so that fronts can be kept apart between steps.
  void evaluate(const marrow::Volume& volume, const EdgeProfile& profile, const Force& force);
  void advance(double step_mm);
  /// Makes the values distances again around what moves, and lets the band follow the front.
  void redistance();
  /// The stop rule: what moved less on average, per tile and since the last call, goes to sleep, and what borders on
  /// something that moves wakes up. True when all is at rest.
  bool rest(double least_motion_mm);

  static void keep_apart(Front& a, Front& b);

  /// Of the moving parts of the surface, between the last two calls of rest().
  double mean_motion_mm() const { return mean_motion_mm_; }
  std::size_t band_voxels() const { return band_voxels_; }
  bool is_at_rest() const { return active_.empty(); }
  std::vector<float>& values_mm() { return values_mm_; }

 private:
  static constexpr int kTile = 8, kHalo = kTile + 2;
  using Halo = std::array<float, kHalo * kHalo * kHalo>;
  struct Extent {
    int first[3], size[3];
  };

  std::size_t tile_count() const { return std::size_t(tiles_[0]) * tiles_[1] * tiles_[2]; }
  Extent extent(std::size_t tile) const;
  void load(const Extent& extent, Halo& halo) const;
  template <class Visit>
  void for_voxels(std::size_t position, const Visit& visit);
  void write_back();
  void choose_active();

  marrow::Grid grid_;
  float band_mm_, near_mm_;
  Eigen::Vector3f voxels_per_mm_;
  std::array<int, 3> tiles_;
  std::vector<float> values_mm_, values_before_, speed_;
  std::vector<std::uint32_t> active_;  // tiles visited in this step, in order
  std::vector<std::uint8_t> is_active_, is_awake_;
  std::vector<float> next_values_;  // of the active tiles
  double mean_motion_mm_ = 0;
  std::size_t band_voxels_ = 0;
};

}  // namespace level_set
