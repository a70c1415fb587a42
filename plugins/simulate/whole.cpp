// SPDX-License-Identifier: Apache-2.0
// An unbroken bone: one fragment, moved by a known rigid transform between CT and images.
#include <cstdlib>
#include <marrow/plugin.hpp>

#include "marrow/simulate/solid.hpp"
#include "marrow/simulate/vectors.hpp"

namespace {

using namespace marrow;
using phantom::Bone, phantom::Fragment, phantom::Phantom;

struct WholeOptions {
  std::array<double, 3> rotation_deg{0, 0, 0}, translation_mm{0, 0, 0};
};

/// At several heights, the middle of the longest part of a line along x that lies in cortical bone. Only lines through
/// the middle half of the section count: a line beside the canal can be long, but its middle may lie on the canal's
/// wall.
std::vector<Eigen::Vector3d> seeds_of(const Bone& bone, const Fragment& fragment) {
  constexpr int kHeights = 14;
  const Eigen::AlignedBox3d box = phantom::bounds_of(bone.outer.vertices_mm);
  const Eigen::Vector3d low = box.min();
  const double step = box.sizes().z() / kHeights, first_z = low.z() + 0.5 * step;
  const int lines = int(box.sizes().y()) + 1;  // 1 mm apart
  const phantom::SolidRays rays({bone, {}, {fragment}}, lines, kHeights, [&](const Fragment&) {
    return [=](const Eigen::Vector3d& p) {
      return phantom::RayVertex{p.y() - low.y(), (p.z() - first_z) / step, p.x()};
    };
  });
  std::array<double, kHeights> longest{};
  std::array<std::array<int, 2>, kHeights> section;  // the first and the last line that meet the bone
  section.fill({lines, -1});
  std::array<Eigen::Vector3d, kHeights> points;
  std::vector<phantom::Interval> intervals;
  const auto crossings = rays.bundle().crossings(0, kHeights);
  phantom::for_each_ray(crossings, [&](std::span<const phantom::Crossing> ray) {
    auto& [first, last] = section[ray[0].row];
    first = std::min(first, int(ray[0].column));
    last = std::max(last, int(ray[0].column));
  });
  phantom::for_each_ray(crossings, [&](std::span<const phantom::Crossing> ray) {
    const std::size_t height = ray[0].row;
    const auto [first, last] = section[height];
    if (std::abs(2 * int(ray[0].column) - first - last) > (last - first) / 2) return;
    rays.intervals(ray, intervals);
    for (const auto& interval : intervals) {
      if (!interval.cortical || interval.to - interval.from <= longest[height]) continue;
      longest[height] = interval.to - interval.from;
      points[height] = {0.5 * (interval.from + interval.to), low.y() + double(ray[0].column),
                        first_z + double(height) * step};
    }
  });
  std::vector<Eigen::Vector3d> seeds;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (longest[i] > 0) seeds.push_back(fragment.ct_from_bone * points[i]);
  return seeds;
}

Phantom whole(const Bone& bone, const WholeOptions& options) {
  phantom::check_bone(bone, "simulate.whole");
  Fragment fragment;
  fragment.name = "bone";
  fragment.outer = bone.outer;
  fragment.outer.frame = "ct";
  fragment.frame = fragment_frame(fragment.outer);
  Vector6d motion;
  for (int k = 0; k < 3; ++k) {
    motion[k] = radians(options.rotation_deg[std::size_t(k)]);
    motion[3 + k] = options.translation_mm[std::size_t(k)];
  }
  fragment.world_from_ct = moved(fragment.world_from_ct, fragment.frame, motion);
  fragment.seeds_mm = seeds_of(bone, fragment);
  Phantom phantom{bone, {}, {fragment}};
  phantom::check_phantom(phantom, "simulate.whole");
  return phantom;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.whole", whole)
      .summary("Moves a whole bone by a known transform between CT and images; the soft tissue keeps its place")
      .in("bone", "whole bone")
      .out("phantom", "one fragment, 'bone', with its poses in the CT and in the images")
      .option("rotation_deg", &WholeOptions::rotation_deg,
              "motion between CT and images: rotation vector about the bone's frontal, lateral and long axis")
      .option("translation_mm", &WholeOptions::translation_mm,
              "motion between CT and images: translation along these axes");
}
