// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/thigh.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "marrow/simulate/knee.hpp"
#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/phantom/loft.hpp"

namespace marrow::phantom {
namespace {

using Eigen::Vector3d;

constexpr int kSides = 240;
constexpr double kLowestMm = -300, kAboveMm = 60, kSeenMm = 130;
constexpr double kFineMm = 1, kCoarseMm = 8;  // between rings, where folds are and elsewhere

double top_of(const Bone& bone) { return bounds_of(bone.outer.vertices_mm).max().z() + kAboveMm; }

/// A surface around the axis of the thigh, from its radius at an angle and a height.
Mesh around(const Bone& bone, const std::function<double(double, double)>& radius_at) {
  std::vector<Points> rings;
  const double top = top_of(bone);
  for (double z = kLowestMm; z < top; z += z >= -kSeenMm && z < kSeenMm ? kFineMm : kCoarseMm) {
    Points& ring = rings.emplace_back();
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2 * kPi * k / kSides, radius = radius_at(angle, z);
      ring.emplace_back(bone.thigh_centre_mm.x() + radius * std::cos(angle),
                        bone.thigh_centre_mm.y() + radius * std::sin(angle), z);
    }
  }
  return loft(rings);
}

Body still(const std::string& name, const std::string& material, Mesh surface) {
  return {.name = name, .material = material, .surface = std::move(surface), .in_ct = true, .moves_with = {}};
}

/// A bulge with a crease beside it, over a part of the circumference.
struct Fold {
  double at_angle, half_span, at_z, slope, phase, width_mm, height_mm;

  double operator()(double angle, double z, double radius) const {
    const double off = std::remainder(angle - at_angle, 2 * kPi);
    if (std::abs(off) >= half_span) return 0;
    const double fading = std::pow(std::cos(0.5 * kPi * off / half_span), 2);
    const double line = at_z + slope * radius * std::sin(off) + 4 * std::sin(3 * angle + phase);
    const double d = (z - line) / width_mm;
    return height_mm * fading * (std::exp(-0.5 * d * d) - 0.6 * std::exp(-0.5 * (d - 2) * (d - 2)));
  }
};

/// Waves around the circumference that turn slowly along the thigh. They lie in -1 to 1 with mean 0.
struct Waves {
  struct Wave {
    int count;
    double share, phase, turn_per_mm;
  };
  std::vector<Wave> waves;
  explicit Waves(Random& random) {
    for (const auto& [count, share] : {std::pair(1, 0.5), std::pair(2, 0.3), std::pair(5, 0.12), std::pair(9, 0.08)})
      waves.push_back({count, share, 2 * kPi * random.uniform(), (random.uniform() - 0.5) * 0.03 * count});
  }
  double operator()(double angle, double z) const {
    double sum = 0;
    for (const Wave& wave : waves) sum += wave.share * std::sin(wave.count * angle + wave.phase + wave.turn_per_mm * z);
    return sum;
  }
};

}  // namespace

std::vector<Body> make_thigh(const Bone& bone, const ThighShape& shape, Random& random) {
  const double outside = bone.thigh_radius_mm, fat = std::min(bone.fat_mm, outside), inside = outside - fat;
  if (!(outside > 0)) return {};
  const Waves waves(random);
  std::vector<Fold> folds;
  for (int i = 0; i < shape.folds; ++i) {
    Fold fold;
    fold.at_angle = 2 * kPi * random.uniform();
    fold.half_span = radians(60 + 70 * random.uniform());
    fold.at_z = -70 + 170 * random.uniform();
    fold.slope = 0.7 * (random.uniform() - 0.5);
    fold.phase = 2 * kPi * random.uniform();
    fold.width_mm = 1.2 + 1.5 * random.uniform();
    fold.height_mm = shape.fold_mm * (0.6 + 0.4 * random.uniform());
    folds.push_back(fold);
  }
  std::vector<Body> tissues;
  tissues.push_back(still("skin", "fat", around(bone, [&](double angle, double z) {
                            double radius = outside;
                            for (const Fold& fold : folds) radius += fold(angle, z, outside);
                            return radius;
                          })));
  if (!(inside > 0)) return tissues;
  // The square of the radius is changed, so that the area stays the same.
  tissues.push_back(still("muscle", "muscle", around(bone, [&](double angle, double z) {
                            const double change = 2 * inside * fat * shape.unevenness * waves(angle, z);
                            return std::sqrt(std::max(0.0, inside * inside + change));
                          })));
  return tissues;
}

std::vector<Body> make_vessels(const Bone& bone, const VesselShape& shape, Random& random) {
  constexpr double kRadiusMm = 3.6, kStepMm = 3, kVeinRadiusMm = 1.8;
  const DistalEnd end = distal_end(bone.outer);
  const double medial = -end.lateral_x;
  const Eigen::Vector2d centre = bone.thigh_centre_mm;
  // From the inner side of the shaft to the middle behind the condyles.
  const auto at = [&](double z) {
    const double above = std::clamp((z - end.lowest_z - 30) / 170, 0.0, 1.0), s = above * above * (3 - 2 * above);
    const Vector3d behind(end.middle_mm.x() + 3 * medial, end.back_y + 11, z),
        beside(centre.x() + 30 * medial, centre.y() + 16, z);
    return Vector3d((1 - s) * behind + s * beside);
  };
  const double phase = 2 * kPi * random.uniform(), top = top_of(bone);
  Points curve;
  for (double z = end.lowest_z - 100; z < top - kAboveMm - 60; z += kStepMm) {
    const double bend = 2 * kPi * z / 45 + phase;
    curve.push_back(at(z) + Vector3d(1.5 * std::sin(bend), 1.2 * std::cos(1.3 * bend), 0));
  }
  std::vector<Body> vessels;
  for (std::size_t first = 0; first + 4 < curve.size();) {
    const std::size_t length = 3 + random.index(6);
    if (random.uniform() < shape.calcified) {
      const Points piece(curve.begin() + std::ptrdiff_t(first),
                         curve.begin() + std::ptrdiff_t(std::min(curve.size(), first + length + 1)));
      const std::vector<double> radii(piece.size(), kRadiusMm + shape.wall_mm);
      vessels.push_back(still("artery's wall", "calcified wall", tube(piece, radii, 24)));
    }
    first += length;
  }
  vessels.push_back(still("artery", "blood", tube(curve, std::vector<double>(curve.size(), kRadiusMm), 24)));
  for (int i = 0; i < shape.veins; ++i) {
    const double start = 2 * kPi * random.uniform(), turn = (random.uniform() - 0.5) * 0.01,
                 depth = bone.thigh_radius_mm - std::max(2.5, 0.5 * bone.fat_mm);
    Points vein;
    for (double z = -200; z < 200; z += kStepMm) {
      const double angle = start + turn * z + 0.05 * std::sin(z / 17 + start);
      vein.emplace_back(centre.x() + depth * std::cos(angle), centre.y() + depth * std::sin(angle), z);
    }
    vessels.push_back(still("vein", "blood", tube(vein, std::vector<double>(vein.size(), kVeinRadiusMm), 16)));
  }
  return vessels;
}

}  // namespace marrow::phantom
