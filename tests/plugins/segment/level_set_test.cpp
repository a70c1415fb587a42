// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/segment/phantom.hpp"

namespace marrow::test::level_set_test {

List<SignedField> level_set_fields(const Volume& volume, const List<Seeds>& seeds) {
  return segmented::fields("segment.level_set", volume, seeds);
}

/// A long bone along z, slightly tilted, that leaves the volume at both ends; its wall gets thinner upwards.
struct HollowBone {
  double inside_hu = -20, wall_low_mm = 7, wall_high_mm = 1.5, radius_low_mm = 13, radius_high_mm = 19;
  Vector3d low{-3, -2, -60}, high{3, 2, 60};
  double outer(const Vector3d& p) const { return bones::round_cone(p, low, high, radius_low_mm, radius_high_mm); }
  double inner(const Vector3d& p) const {
    return bones::round_cone(p, low, high, radius_low_mm - wall_low_mm, radius_high_mm - wall_high_mm);
  }
  double hu(const Vector3d& p, double cut_mm = -1e9) const {
    const double bone = bones::filled(std::max(outer(p), cut_mm)), canal = bones::filled(inner(p));
    return 50 + bone * (1400 - 50) + bone * canal * (inside_hu - 1400);
  }
  /// Halfway through the wall.
  Vector3d seed(double z) const {
    const double t = (z - low.z()) / (high.z() - low.z());
    const Vector3d axis = low + t * (high - low);
    const double outer_mm = radius_low_mm + t * (radius_high_mm - radius_low_mm),
                 wall_mm = wall_low_mm + t * (wall_high_mm - wall_low_mm);
    return axis + Vector3d(outer_mm - wall_mm / 2, 0, 0);
  }
  List<Seeds> seeds(double proximal_z, double distal_z, bool is_proximal_wanted = true) const {
    return named("proximal", Seeds{"proximal", {seed(proximal_z)}, is_proximal_wanted}, "distal",
                 Seeds{"distal", {seed(distal_z)}});
  }
};

TEST(LevelSet, HollowBoneOverMarrowAndOverSpongyBone) {
  for (double inside_hu : {-20.0, 300.0}) {
    HollowBone bone;
    bone.inside_hu = inside_hu;
    const Volume volume = bones::scan(
        bones::ct_grid({64, 60, 110}), [&](const Vector3d& p) { return bone.hu(p); }, 0.5, 30, 1);
    const auto fields = level_set_fields(volume, named("distal", Seeds{"distal", {bone.seed(-20)}}));
    ASSERT_EQ(fields.size(), 1u);
    const auto accuracy = bones::compare(fields[0], [&](const Vector3d& p) { return bone.outer(p); });
    bones::expect_within(accuracy, 0.99, 0.03, 0.08);
  }
}

/// Both fragments of a bone with an oblique gap, on their walls farther than `beside_mm` from its middle.
void expect_both(const Grid& grid, double gap_mm, double proximal_z, double distal_z, double beside_mm, double bias_mm,
                 double mean_mm) {
  HollowBone bone;
  bone.wall_high_mm = 4;
  const Vector3d normal = Vector3d(0.5, 0.2, 1).normalized();
  const Volume volume = bones::scan(
      grid, [&](const Vector3d& p) { return bone.hu(p, gap_mm / 2 - std::abs(normal.dot(p))); }, 0.5, 30, 2);
  const auto fields = level_set_fields(volume, bone.seeds(proximal_z, distal_z));
  ASSERT_EQ(fields.size(), 2u);
  for (std::size_t f = 0; f < 2; ++f) {
    const double side = f == 0 ? -1 : 1;
    const auto truth = [&](const Vector3d& p) { return std::max(bone.outer(p), side * normal.dot(p) + gap_mm / 2); };
    const auto on_wall = [&](const Vector3d& p) { return std::abs(normal.dot(p)) > beside_mm; };
    bones::expect_within(bones::compare(fields[f], truth, on_wall), 0.97, bias_mm, mean_mm);
  }
  EXPECT_EQ(bones::overlap(fields), 0u);
}

TEST(LevelSet, TwoFragmentsOneMillimetreApart) {
  expect_both(bones::ct_grid({64, 60, 110}), 1, 30, -30, 4, 0.03, 0.08);
}

TEST(LevelSet, TwoFragmentsInVoxelsAsWideAsTheGap) {
  Grid grid = bones::ct_grid({44, 42, 92});
  grid.spacing_mm.setConstant(1.2);
  grid.origin_mm = -Vector3d(43, 41, 91) * 0.6;
  for (double gap_mm : {1.2, 2.0, 4.0}) expect_both(grid, gap_mm, 40, -15, 5, 0.05, 0.1);
}

TEST(LevelSet, AFragmentIsTheSameWhetherTheOtherIsWantedOrOnlyKeptApart) {
  HollowBone bone;
  bone.wall_high_mm = 4;
  const Volume volume = bones::scan(
      bones::ct_grid({64, 60, 150}), [&](const Vector3d& p) { return bone.hu(p, 0.5 - std::abs(p.z())); }, 0.5, 30, 2);
  const auto distal = [&](bool other_is_wanted) {
    const auto fields = level_set_fields(volume, bone.seeds(30, -30, other_is_wanted));
    EXPECT_EQ(fields.size(), other_is_wanted ? 2u : 1u);
    return *fields.find("distal");
  };
  EXPECT_EQ(distal(true).values_mm, distal(false).values_mm);
}

TEST(LevelSet, ADistalEndWithThinCortexAndAnInvisibleGap) {
  const bones::DistalEnd bone;
  const auto fields = level_set_fields(bone.scan_of({128, 128, 192}, 40), bone.seeds());
  for (std::size_t f = 0; f < 2; ++f) bones::expect_within(bone.compare(fields, f), 0.99, 0.06, 0.1);
}

/// A short bone in a grid that is turned against the frame, both ends inside the volume.
struct ShortBone {
  Grid grid = bones::ct_grid({48, 48, 56});
  ShortBone() {
    grid.direction = Eigen::AngleAxisd(0.5, Vector3d(1, -1, 2).normalized()).toRotationMatrix();
    const Vector3d middle = Vector3d(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1) / 2;
    grid.origin_mm = Vector3d(100, -50, 30) - grid.direction * middle.cwiseProduct(grid.spacing_mm);
  }
  Vector3d at(double x, double y, double z) const {
    return Vector3d(100, -50, 30) + grid.direction * Vector3d(x, y, z);
  }
  double outer(const Vector3d& p) const { return bones::round_cone(p, at(0, 0, -10), at(0, 0, 10), 9, 11); }
  double hu(const Vector3d& p) const { return 50 + 1300 * bones::filled(outer(p)) * bones::filled(-outer(p) - 3); }
  Volume volume() const {
    return bones::scan(
        grid, [&](const Vector3d& p) { return hu(p); }, 0.5, 30, 4);
  }
  List<Seeds> seeds(const Vector3d& point) const { return named("distal", Seeds{"distal", {point}}); }
};

TEST(LevelSet, ABoneInATurnedGrid) {
  const ShortBone bone;
  const auto fields = level_set_fields(bone.volume(), bone.seeds(bone.at(8.5, 0, 0)));
  const auto accuracy = bones::compare(fields[0], [&](const Vector3d& p) { return bone.outer(p); });
  bones::expect_within(accuracy, 0.985, 0.06, 0.09);
}

std::string message_of(const Volume& volume, const List<Seeds>& seeds) {
  return refusal("segment.level_set", segmented::inputs(volume, seeds));
}

TEST(LevelSet, SaysWhatIsWrongWithSeeds) {
  const ShortBone bone;
  Volume volume{bone.grid, std::vector<float>(bone.grid.count(), 40.f)};
  EXPECT_EQ(message_of(volume, {}),
            "seeds: there are none; give at least one fragment with one point inside its bone (seeds in case.yaml)");
  EXPECT_EQ(message_of(volume, bone.seeds(bone.at(0, 0, 0))),
            "seeds of fragment 'distal': point 1 at (100.0, -50.0, 30.0) mm is not in bone: the CT shows 40 HU there, "
            "at least 150 HU expected; move it into cortical or spongy bone");
  EXPECT_EQ(message_of(volume, bone.seeds(Vector3d(900, 0, 0))),
            "seeds of fragment 'distal': point 1 at (900.0, 0.0, 0.0) mm lies outside the volume; seeds are points of "
            "the CT's frame 'ct' in mm");
  volume.values[5] = std::nanf("");
  EXPECT_HAS(message_of(volume, {}), "is not a finite number");
}

}  // namespace marrow::test::level_set_test
