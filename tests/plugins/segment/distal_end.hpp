// SPDX-License-Identifier: Apache-2.0
#pragma once
// The distal end of a femur, broken through its spongy bone with a gap of 1 mm: a scene that no single threshold
// segments. The shaft's cortex is thick and bright; towards the joint it thins out to less than a voxel over spongy
// bone of 280 HU, and the fracture's faces have no cortex at all.
#include "tests/plugins/segment/phantom.hpp"

namespace marrow::test::bones {

struct DistalEnd {
  double gap_mm = 1, spongy_hu = 280, tissue_hu = 50, marrow_hu = -40;
  Vector3d cut_normal = Vector3d(0.35, 0.15, 1).normalized(), cut_point{0, 0, -25};

  /// Below zero in the bone, near its surface a distance: shaft, its flare and two condyles, blended over 6 mm.
  double outline(const Vector3d& p) const {
    const double shaft = round_cone(p, {0, 0, -20}, {2, 3, 140}, 17, 14),
                 flare = round_cone(p, {0, 0, -62}, {0, 0, -10}, 25, 17.5);
    const double medial = round_cone(p, {-20, -4, -66}, {-20, 10, -66}, 20, 19),
                 lateral = round_cone(p, {20, -6, -65}, {20, 8, -64}, 19, 19);
    return blend(blend(shaft, flare), blend(medial, lateral));
  }
  double over_cut_mm(const Vector3d& p) const { return cut_normal.dot(p - cut_point); }
  /// Signed distance to the surface of the proximal (side 1) or the distal fragment (-1).
  double distance(const Vector3d& p, int side) const {
    return std::max(outer_distance(p), 0.5 * gap_mm - side * over_cut_mm(p));
  }
  double outer_distance(const Vector3d& p) const {
    const double value = outline(p);
    if (std::abs(value) > 3) return value;
    Vector3d slope;
    for (int k = 0; k < 3; ++k) {
      const Vector3d step = 0.05 * Vector3d::Unit(k);
      slope[k] = (outline(p + step) - outline(p - step)) / 0.1;
    }
    return value / std::max(slope.norm(), 0.3);
  }

  static double fade(double z, double low, double high) { return std::clamp((z - low) / (high - low), 0.0, 1.0); }
  double hu(const Vector3d& p) const {
    const double surface = outline(p), cortex_mm = 0.6 + 4.4 * fade(p.z(), -50, 40),
                 cortex_hu = 1000 + 300 * fade(p.z(), -50, 0);
    const double inside_hu = spongy_hu + (marrow_hu - spongy_hu) * fade(p.z(), 0, 35);
    const double bone = filled(std::max(surface, 0.5 * gap_mm - std::abs(over_cut_mm(p)))),
                 core = filled(surface + cortex_mm);
    return tissue_hu + bone * (cortex_hu + core * (inside_hu - cortex_hu) - tissue_hu);
  }
  Volume scan_of(std::array<int, 3> size, double noise_hu) const {
    return scan(
        ct_grid(size), [this](const Vector3d& p) { return hu(p); }, 0.5, noise_hu, 5);
  }
  List<Seeds> seeds() const {
    List<Seeds> seeds;
    seeds.add("proximal", Seeds{"proximal", {{0, 0, -10}, {13, 1, 50}, {-12, 2, 50}}});
    seeds.add("distal", Seeds{"distal", {{-20, 0, -66}, {20, 0, -64}, {0, 0, -45}}});
    return seeds;
  }

 private:
  static double blend(double a, double b) {
    const double overlap = std::max(6 - std::abs(a - b), 0.0) / 6;
    return std::min(a, b) - overlap * overlap * 6 / 4;
  }
};

}  // namespace marrow::test::bones

namespace phantom = marrow::test::bones;
