// SPDX-License-Identifier: Apache-2.0
#pragma once
// A moving surface: a signed distance that is kept only in a narrow band around its zero level (Adalsteinsson and
// Sethian, A fast level set method for propagating interfaces, J. Comput. Phys. 1995). The grid is divided into tiles
// of 8 x 8 x 8 voxels. Only tiles near the surface have memory. Only tiles near a moving part of the surface are
// visited. So memory grows with the area of the surface, and the time of a step with the area that moves.
#include <algorithm>
#include <cmath>

#include "marrow/domain/transform.hpp"
#include "marrow/segment/fragments.hpp"

namespace marrow::segment {

/// Trilinear value at a fractional index, clamped to the border. The volume must have at least two voxels along each
/// axis.
inline float sample(const marrow::Volume& volume, float x, float y, float z) {
  const auto& size = volume.grid.size;
  x = std::clamp(x, 0.f, float(size[0] - 1));
  y = std::clamp(y, 0.f, float(size[1] - 1));
  z = std::clamp(z, 0.f, float(size[2] - 1));
  const int i = std::min(int(x), size[0] - 2), j = std::min(int(y), size[1] - 2), k = std::min(int(z), size[2] - 2);
  const float a = x - float(i), b = y - float(j), c = z - float(k);
  const float* v = volume.values.data() + volume.grid.offset(i, j, k);
  const std::size_t row = std::size_t(size[0]), slice = row * size[1];
  const auto line = [&](std::size_t at) { return v[at] + a * (v[at + 1] - v[at]); };
  const auto plane = [&](std::size_t at) {
    const float first = line(at);
    return first + b * (line(at + row) - first);
  };
  const float first = plane(0);
  return first + c * (plane(slice) - first);
}

/// What the CT shows along a normal.
struct Edge {
  double mean_hu = 0;    ///< smoothed value at the point
  double drop_hu = 0;    ///< height of a step from bright inside to dark outside; negative for the opposite step
  double offset_mm = 0;  ///< distance of the point outside the steepest descent; 0 if there is no descent
};

/// The image force of the level set: 1D Gaussian derivatives of the CT along the normal of the front.
class EdgeProfile {
 public:
  /// `sigma_mm`: standard deviation of the Gaussian derivative. `blur_mm`: standard deviation of the CT's own blur of
  /// an ideal edge. `cortex_hu`: value assumed for a cortex that is too thin for the CT to show its true value.
  EdgeProfile(double sigma_mm, double blur_mm, double cortex_hu)
      : step_mm_(kStep * sigma_mm), variance_mm2_(sigma_mm * sigma_mm + blur_mm * blur_mm), cortex_hu_(cortex_hu) {
    double sum = 0, second_sum = 0, half = 0;
    for (int k = -kReach; k <= kReach; ++k) {
      const double t = k * kStep;  // in sigmas
      weights_[k + kReach][0] = std::exp(-0.5 * t * t);
      sum += weights_[k + kReach][0];
    }
    for (auto& w : weights_) w[0] /= sum;
    for (int k = -kReach; k <= kReach; ++k) {
      const double t = k * kStep;
      auto& w = weights_[k + kReach];
      w[1] = -t / sigma_mm * w[0];
      w[2] = (t * t - 1) / (sigma_mm * sigma_mm) * w[0];
      second_sum += w[2];
      if (k < 0) half += w[1];
    }
    for (auto& w : weights_) w[2] -= second_sum / (2 * kReach + 1);  // a constant has no second derivative
    drop_per_slope_mm_ = 1 / half;
  }

  /// `index`: the point, as a fractional index. `normal_index`: 1 mm along the outward normal, in voxels.
  Edge at(const marrow::Volume& volume, const Eigen::Vector3f& index, const Eigen::Vector3f& normal_index) const {
    double mean = 0, slope = 0, bend = 0;
    const Eigen::Vector3f step = normal_index * float(step_mm_);
    Eigen::Vector3f p = index - float(kReach) * step;
    for (const auto& w : weights_) {
      const double value = sample(volume, p.x(), p.y(), p.z());
      mean += w[0] * value;
      slope += w[1] * value;
      bend += w[2] * value;
      p += step;
    }
    // For a step with blur S: second derivative / -(first derivative) = offset / S^2. `slope` is the negated first
    // derivative.
    return {mean, slope * drop_per_slope_mm_, slope > 1e-3 ? variance_mm2_ * bend / slope : 0};
  }

  /// Distance in mm from the true surface of a thin cortex to the edge that at() sees. Blur moves this edge outwards. A
  /// point on the true surface has offset_mm = -shift. 0 where the cortex is thick enough or not found.
  /// The CT shows more than a step from spongy bone to tissue would. This excess and the cortex's density give the
  /// cortex's thickness (after Treece, Gee, Mayhew and Poole, Med. Image Anal. 2010).
  /// `index`: a point on the surface; `normal_index` as in at().
  double thin_cortex_shift_mm(const marrow::Volume& volume, const Eigen::Vector3f& index,
                              const Eigen::Vector3f& normal_index) const {
    constexpr double kStep_mm = 0.5;
    double spongy = 0, tissue = 0, brightest = -1e9, sum = 0;
    for (int k = -8; k <= 7; ++k) {
      const Eigen::Vector3f p = index + float((k + 0.5) * kStep_mm) * normal_index;
      const double value = sample(volume, p.x(), p.y(), p.z());
      if (k < -5)
        spongy += value / 3;
      else if (k > 4)
        tissue += value / 3;
      else
        sum += value, brightest = std::max(brightest, value);
    }
    const double cortex = std::max(cortex_hu_, brightest), light = (sum - 5 * spongy - 5 * tissue) * kStep_mm;
    const double is_thin =
        std::clamp(((brightest - spongy) / std::max(brightest - tissue, 1.0) - 0.15) / 0.15, 0.0, 1.0);
    if (is_thin == 0 || light <= 0 || spongy - tissue < 50 || cortex - spongy < 100) return 0;
    // A cortex of thickness k s lies between tissue outside and spongy bone inside. With blur s and e = exp(-k^2 / 2),
    // its surface has the slope -((cortex - tissue) - (cortex - spongy) e) / s and the second derivative
    // -(cortex - spongy) k e / s^2, both divided by sqrt(2 pi). at() computes the offset from these two.
    const double s = std::sqrt(variance_mm2_), k = light / (cortex - spongy) / s,
                 part = (cortex - spongy) / (cortex - tissue);
    const double e = std::exp(-0.5 * k * k);
    return is_thin * s * std::min(part * k * e / (1 - part * e), 1.5);
  }

 private:
  static constexpr int kReach = 4;       // samples on either side
  static constexpr double kStep = 0.75;  // in sigmas
  double step_mm_, variance_mm2_, cortex_hu_, drop_per_slope_mm_ = 1;
  std::array<std::array<double, 3>, 2 * kReach + 1> weights_{};
};

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
