// SPDX-License-Identifier: Apache-2.0
#include "plugins/segment/level_set.cpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cstring>

#include "segment/phantom.hpp"

namespace {

using Eigen::Vector3d;

/// A long bone along z, slightly tilted, that leaves the volume at both ends, of a wall that gets thinner upwards.
struct HollowBone {
  double inside_hu = -20, wall_low_mm = 7, wall_high_mm = 1.5, radius_low_mm = 13, radius_high_mm = 19;
  Vector3d low{-3, -2, -60}, high{3, 2, 60};
  double outer(const Vector3d& p) const { return phantom::round_cone(p, low, high, radius_low_mm, radius_high_mm); }
  double inner(const Vector3d& p) const {
    return phantom::round_cone(p, low, high, radius_low_mm - wall_low_mm, radius_high_mm - wall_high_mm);
  }
  double hu(const Vector3d& p, double cut_mm = -1e9) const {
    const double bone = phantom::filled(std::max(outer(p), cut_mm)), canal = phantom::filled(inner(p));
    return 50 + bone * (1400 - 50) + bone * canal * (inside_hu - 1400);
  }
  /// Halfway through the wall.
  Vector3d seed(double z) const {
    const double t = (z - low.z()) / (high.z() - low.z());
    const Vector3d axis = low + t * (high - low);
    const double outer_mm = radius_low_mm + t * (radius_high_mm - radius_low_mm), wall_mm = wall_low_mm + t * (wall_high_mm - wall_low_mm);
    return axis + Vector3d(outer_mm - wall_mm / 2, 0, 0);
  }
};

double timed(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Context printing() {
  Context::Hooks hooks;
  hooks.log = [](std::string_view message, bool) { std::printf("  %.*s\n", int(message.size()), message.data()); };
  return Context(hooks);
}

TEST(LevelSet, HollowBoneOverMarrowAndOverSpongyBone) {
  for (double inside_hu : {-20.0, 300.0}) {
    HollowBone bone;
    bone.inside_hu = inside_hu;
    const Volume volume = phantom::scan(phantom::ct_grid({64, 60, 110}), [&](const Vector3d& p) { return bone.hu(p); }, 0.5, 30, 1);
    List<Seeds> seeds;
    seeds.add("distal", Seeds{"distal", {bone.seed(-20)}});
    Context context = printing();
    List<SignedField> fields;
    const double seconds = timed([&] { fields = level_set_fields(volume, seeds, {}, context); });
    ASSERT_EQ(fields.size(), 1u);
    const auto accuracy = phantom::compare(fields[0], [&](const Vector3d& p) { return bone.outer(p); });
    phantom::print("inside " + std::to_string(int(inside_hu)) + " HU", accuracy);
    for (double z : {-45, -15, 15, 45})
      phantom::print("  z " + std::to_string(int(z)),
                     phantom::compare(fields[0], [&](const Vector3d& p) { return bone.outer(p); },
                                      [&](const Vector3d& p) { return std::abs(p.z() - z) < 5; }));
    std::printf("%.2f s\n", seconds);
    EXPECT_GT(accuracy.dice, 0.97);
    EXPECT_LT(std::abs(accuracy.bias_mm), 0.1);
    EXPECT_LT(accuracy.mean_mm, 0.15);
  }
}

TEST(LevelSet, TwoFragmentsOneMillimetreApart) {
  HollowBone bone;
  bone.wall_high_mm = 4;
  const Vector3d normal = Vector3d(0.5, 0.2, 1).normalized();
  const auto cut = [&](const Vector3d& p) { return 0.5 - std::abs(normal.dot(p)); };  // > 0 in the gap
  const Volume volume = phantom::scan(phantom::ct_grid({64, 60, 110}), [&](const Vector3d& p) { return bone.hu(p, cut(p)); }, 0.5, 30, 2);
  List<Seeds> seeds;
  seeds.add("proximal", Seeds{"proximal", {bone.seed(30)}});
  seeds.add("distal", Seeds{"distal", {bone.seed(-30)}});
  Context context = printing();
  const auto fields = level_set_fields(volume, seeds, {}, context);
  ASSERT_EQ(fields.size(), 2u);
  for (std::size_t f = 0; f < 2; ++f) {
    const double side = f == 0 ? -1 : 1;
    const auto truth = [&](const Vector3d& p) { return std::max(bone.outer(p), side * normal.dot(p) + 0.5); };
    const auto on_wall = [&](const Vector3d& p) { return std::abs(normal.dot(p)) > 4; };
    phantom::print(fields.name(f) + " wall", phantom::compare(fields[f], truth, on_wall));
    phantom::print(fields.name(f) + " fracture", phantom::compare(fields[f], truth, [&](const Vector3d& p) { return !on_wall(p); }));
    EXPECT_GT(phantom::compare(fields[f], truth).dice, 0.97);
  }
}

}  // namespace
