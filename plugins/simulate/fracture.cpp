// SPDX-License-Identifier: Apache-2.0
// Breaks the shaft of a bone along an oblique, rough surface and moves the fragments by known rigid transforms.
#include <marrow/plugin.hpp>

#include "marrow/simulate/solid.hpp"
#include "marrow/simulate/vectors.hpp"

namespace {

using namespace marrow;
using phantom::Bone, phantom::Fragment, phantom::Phantom;

struct FractureOptions {
  double height_fraction = 0.45;
  double obliquity_deg = 30;
  double direction_deg = 30;
  double roughness_mm = 0.8;
  int fracture_seed = 1;
  std::array<double, 3> ct_gap_mm{0, 0, -2};
  std::array<double, 3> rotation_deg{0, 0, 0}, translation_mm{0, 0, 0};
  std::array<double, 3> proximal_rotation_deg{0, 0, 0}, proximal_translation_mm{0, 0, 0};
};

constexpr double kRasterMm = 0.8;

/// Centre of the bone's outline at a height: the mean of the outline's segments, weighted by their lengths.
Eigen::Vector2d centre_at(const Mesh& mesh, double z) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double length = 0;
  for (const auto& t : mesh.triangles) {
    std::array<Eigen::Vector2d, 3> cut;
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d &a = mesh.vertices_mm[t[k]], &b = mesh.vertices_mm[t[(k + 1) % 3]];
      if ((a.z() < z) != (b.z() < z)) cut[count++] = (a + (z - a.z()) / (b.z() - a.z()) * (b - a)).head<2>();
    }
    if (count < 2) continue;
    const double piece = (cut[1] - cut[0]).norm();
    sum += piece * 0.5 * (cut[0] + cut[1]);
    length += piece;
  }
  return length > 0 ? Eigen::Vector2d(sum / length) : Eigen::Vector2d::Zero();
}

/// Height of the fracture at (x, y): a plane with a self-affine relief. The relief is a sum of waves whose amplitude is
/// proportional to their length to the power 0.8 (Hurst exponent of fracture surfaces: Bouchaud, J. Phys. Condens.
/// Matter 1997).
class Relief {
 public:
  Relief(const FractureOptions& options, const Eigen::Vector3d& centre) : centre_(centre) {
    const double slope = std::tan(radians(options.obliquity_deg)), direction = radians(options.direction_deg);
    slope_ = slope * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    marrow::Random random(std::uint64_t(options.fracture_seed), 3);
    double power = 0;
    for (Wave& wave : waves_) {
      const double length = 3 * std::pow(40.0 / 3, random.uniform_above_0()),
                   angle = 2 * kPi * random.uniform_above_0();
      wave.number = 2 * kPi / length * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      wave.phase = 2 * kPi * random.uniform_above_0();
      wave.amplitude = std::pow(length, 0.8);
      power += 0.5 * wave.amplitude * wave.amplitude;
    }
    for (Wave& wave : waves_) wave.amplitude *= options.roughness_mm / std::sqrt(power);
  }
  double operator()(const Eigen::Vector2d& at) const {
    const Eigen::Vector2d from = at - centre_.head<2>();
    double height = centre_.z() + slope_.dot(from);
    for (const Wave& wave : waves_) height += wave.amplitude * std::sin(wave.number.dot(from) + wave.phase);
    return height;
  }

 private:
  struct Wave {
    Eigen::Vector2d number;
    double phase, amplitude;
  };
  Eigen::Vector3d centre_;
  Eigen::Vector2d slope_;
  std::array<Wave, 48> waves_;
};

/// A closed block below the relief. It contains the distal side of the bone.
Mesh block_below(const Relief& relief, const Eigen::AlignedBox3d& box) {
  constexpr double kMarginMm = 5;
  const Eigen::Vector2d low = box.min().head<2>().array() - kMarginMm,
                        extent = box.sizes().head<2>().array() + 2 * kMarginMm;
  const std::uint32_t nx = std::uint32_t(extent.x() / kRasterMm) + 2, ny = std::uint32_t(extent.y() / kRasterMm) + 2;
  Mesh mesh;
  mesh.frame = "bone";
  double lowest = box.min().z();
  for (std::uint32_t y = 0; y < ny; ++y)
    for (std::uint32_t x = 0; x < nx; ++x) {
      const Eigen::Vector2d at = low + kRasterMm * Eigen::Vector2d(x, y);
      mesh.vertices_mm.emplace_back(at.x(), at.y(), relief(at));
      lowest = std::min(lowest, mesh.vertices_mm.back().z());
    }
  const auto top = [&](std::uint32_t x, std::uint32_t y) { return y * nx + x; };
  for (std::uint32_t y = 0; y + 1 < ny; ++y)
    for (std::uint32_t x = 0; x + 1 < nx; ++x) {
      mesh.triangles.push_back({top(x, y), top(x + 1, y), top(x + 1, y + 1)});
      mesh.triangles.push_back({top(x, y), top(x + 1, y + 1), top(x, y + 1)});
    }
  std::vector<std::uint32_t> rim;  // counter-clockwise if seen from above
  for (std::uint32_t x = 0; x + 1 < nx; ++x) rim.push_back(top(x, 0));
  for (std::uint32_t y = 0; y + 1 < ny; ++y) rim.push_back(top(nx - 1, y));
  for (std::uint32_t x = nx - 1; x > 0; --x) rim.push_back(top(x, ny - 1));
  for (std::uint32_t y = ny - 1; y > 0; --y) rim.push_back(top(0, y));
  const std::uint32_t floor = std::uint32_t(mesh.vertices_mm.size());
  for (std::uint32_t corner : rim) {
    const Eigen::Vector3d above = mesh.vertices_mm[corner];
    mesh.vertices_mm.emplace_back(above.x(), above.y(), lowest - kMarginMm);
  }
  const std::uint32_t middle = std::uint32_t(mesh.vertices_mm.size()), count = std::uint32_t(rim.size());
  mesh.vertices_mm.emplace_back(low.x() + 0.5 * extent.x(), low.y() + 0.5 * extent.y(), lowest - kMarginMm);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t j = (i + 1) % count;
    mesh.triangles.push_back({rim[i], floor + i, floor + j});
    mesh.triangles.push_back({rim[i], floor + j, rim[j]});
    mesh.triangles.push_back({floor + j, floor + i, middle});
  }
  return mesh;
}

/// The bone's outer surface on one side of the fracture, in CT coordinates. The fragment's axes come from it.
Mesh side_of(const Bone& bone, const Relief& relief, const Fragment& fragment) {
  Mesh mesh;
  for (const auto& vertex : bone.outer.vertices_mm) mesh.vertices_mm.push_back(fragment.ct_from_bone * vertex);
  for (const auto& t : bone.outer.triangles) {
    const Eigen::Vector3d middle =
        (bone.outer.vertices_mm[t[0]] + bone.outer.vertices_mm[t[1]] + bone.outer.vertices_mm[t[2]]) / 3;
    if ((middle.z() < relief(middle.head<2>())) == (fragment.side < 0)) mesh.triangles.push_back(t);
  }
  if (mesh.triangles.empty())
    throw Error("simulate.fracture: no bone is left on the " + fragment.name +
                " side; choose a height_fraction nearer 0.5 or a smaller obliquity_deg");
  return mesh;
}

/// Adds seeds along lines in x (`along` 0) or y (`along` 1) through the bone's centre, at several heights. A seed is
/// the middle of a section of the line that lies in thick cortex, or in cancellous bone that is clearly denser than
/// marrow.
void add_seeds(const Phantom& phantom, const Fragment& fragment, int along, std::vector<Eigen::Vector3d>& seeds) {
  constexpr int kHeights = 14;
  constexpr double kThickMm = 3, kDense = 0.12;
  const int across = 1 - along;
  const Eigen::AlignedBox3d box = phantom::bounds_of(phantom.bone.outer.vertices_mm);
  const double low = box.min()[across], step = box.sizes().z() / kHeights, first_z = box.min().z() + 0.5 * step;
  const int lines = int(box.max()[across] - low) + 1;  // 1 mm apart
  // (y, z, x) and (z, x, y) are right-handed.
  const phantom::SolidRays rays(
      {phantom.bone, phantom.fracture, {fragment}}, along == 0 ? lines : kHeights, along == 0 ? kHeights : lines,
      [&](const Fragment&) {
        return [=](const Eigen::Vector3d& p) {
          const double side = p[across] - low, up = (p.z() - first_z) / step;
          return along == 0 ? phantom::RayVertex{side, up, p.x()} : phantom::RayVertex{up, side, p.y()};
        };
      });
  std::vector<Eigen::Vector2d> centres;
  for (int i = 0; i < kHeights; ++i) centres.push_back(centre_at(phantom.bone.outer, first_z + i * step));
  const phantom::Fill fill(phantom.bone);
  std::vector<phantom::Interval> intervals;
  const auto crossings = rays.bundle().crossings(0, rays.bundle().rows());
  phantom::for_each_ray(crossings, [&](std::span<const phantom::Crossing> ray) {
    const std::uint32_t line = along == 0 ? ray[0].column : ray[0].row,
                        height = along == 0 ? ray[0].row : ray[0].column;
    if (line != std::uint32_t(std::lround(centres[height][across] - low))) return;
    Eigen::Vector3d point;
    point[across] = low + line;
    point.z() = first_z + height * step;
    rays.intervals(ray, intervals);
    for (const auto& interval : intervals) {
      if (interval.cortical ? interval.to - interval.from < kThickMm : fill.at(point.z()) < kDense) continue;
      point[along] = 0.5 * (interval.from + interval.to);
      seeds.push_back(fragment.ct_from_bone * point);
    }
  });
}

Vector6d motion(const std::array<double, 3>& rotation_deg, const std::array<double, 3>& translation_mm) {
  Vector6d result;
  for (int k = 0; k < 3; ++k) {
    result[k] = radians(rotation_deg[std::size_t(k)]);
    result[3 + k] = translation_mm[std::size_t(k)];
  }
  return result;
}

Phantom fracture(const Bone& bone, const FractureOptions& options) {
  phantom::check_bone(bone, "simulate.fracture");
  if (!(options.height_fraction >= 0.1 && options.height_fraction <= 0.9))
    throw Error(formatted("simulate.fracture: the height_fraction {:f} must lie in 0.1 to 0.9 of the bone's length",
                          options.height_fraction));
  const Eigen::AlignedBox3d box = phantom::bounds_of(bone.outer.vertices_mm);
  const double z = box.min().z() + options.height_fraction * box.sizes().z();
  const Eigen::Vector2d at = centre_at(bone.outer, z);
  const Relief relief(options, {at.x(), at.y(), z});
  Phantom phantom;
  phantom.bone = bone;
  phantom.fracture = block_below(relief, box);
  for (const bool distal : {false, true}) {
    Fragment fragment;
    fragment.name = distal ? "distal" : "proximal";
    fragment.side = distal ? -1 : 1;
    if (distal) fragment.ct_from_bone.translation_mm = Eigen::Vector3d(options.ct_gap_mm.data());
    fragment.outer = side_of(bone, relief, fragment);
    fragment.frame = fragment_frame(fragment.outer);
    fragment.world_from_ct = moved(fragment.world_from_ct, fragment.frame,
                                   distal ? motion(options.rotation_deg, options.translation_mm)
                                          : motion(options.proximal_rotation_deg, options.proximal_translation_mm));
    phantom.fragments.push_back(fragment);
  }
  for (Fragment& fragment : phantom.fragments)
    for (const int along : {0, 1}) add_seeds(phantom, fragment, along, fragment.seeds_mm);
  phantom::check_phantom(phantom, "simulate.fracture");
  return phantom;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.fracture", fracture)
      .summary("Breaks the shaft of a bone along an oblique, rough surface and moves the fragments by known transforms")
      .in("bone", "whole bone")
      .out("phantom", "two fragments, proximal and distal, with their poses in the CT and in the images")
      .option("height_fraction", &FractureOptions::height_fraction,
              "height of the fracture, as a fraction of the length from the distal end", at_least(0.1), at_most(0.9),
              unit(""))
      .option("obliquity_deg", &FractureOptions::obliquity_deg, "tilt of the fracture; 0: transverse", at_least(0),
              at_most(65))
      .option("direction_deg", &FractureOptions::direction_deg,
              "direction in which the fracture rises: 0: to the patient's left, 90: to the back")
      .option("roughness_mm", &FractureOptions::roughness_mm, "root mean square of the fracture's relief", at_least(0),
              at_most(4))
      .option("fracture_seed", &FractureOptions::fracture_seed, "seed of the relief", at_least(0))
      .option("ct_gap_mm", &FractureOptions::ct_gap_mm, "displacement of the distal fragment in the CT")
      .option("rotation_deg", &FractureOptions::rotation_deg,
              "motion of the distal fragment between CT and images: rotation vector about its frontal, lateral and "
              "long axis")
      .option("translation_mm", &FractureOptions::translation_mm,
              "motion of the distal fragment between CT and images: translation along these axes")
      .option("proximal_rotation_deg", &FractureOptions::proximal_rotation_deg,
              "like rotation_deg, for the proximal fragment")
      .option("proximal_translation_mm", &FractureOptions::proximal_translation_mm,
              "like translation_mm, for the proximal fragment");
}
