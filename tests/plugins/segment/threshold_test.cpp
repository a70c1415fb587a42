// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/segment/distal_end.hpp"
#include "tests/plugins/segment/segmented.hpp"

namespace marrow::test::threshold_test {

constexpr const char* kNode = "segment.threshold";

/// Two capsules with a wall of 3 mm over marrow.
struct Pair {
  double first(const Vector3d& p) const { return bones::round_cone(p, {0, 0, -20}, {0, 0, -18}, 11, 11); }
  double second(const Vector3d& p) const { return bones::round_cone(p, {0, 0, 12}, {0, 0, 20}, 12, 12); }
  double hu(const Vector3d& p) const {
    const double outer = std::min(first(p), second(p));
    return 50 + 1000 * bones::filled(outer) - 1050 * bones::filled(outer + 3);
  }
  Volume volume() const {
    return bones::scan(
        bones::ct_grid({44, 44, 80}), [&](const Vector3d& p) { return hu(p); }, 0.5, 20, 7);
  }
};

TEST(Threshold, OneFieldForEachFragmentWithItsCanalFilled) {
  const Pair pair;
  List<Seeds> seeds;
  seeds.add("proximal", Seeds{"proximal", {{10.5, 0, 16}}});
  seeds.add("distal", Seeds{"distal", {{9.5, 0, -19}}});
  const auto fields = segmented::fields(kNode, pair.volume(), seeds, {{"threshold_hu", 550.0}});
  ASSERT_EQ(fields.size(), 2u);
  const auto proximal = bones::compare(fields[0], [&](const Vector3d& p) { return pair.second(p); });
  const auto distal = bones::compare(fields[1], [&](const Vector3d& p) { return pair.first(p); });
  for (const auto& accuracy : {proximal, distal}) {
    EXPECT_GT(accuracy.dice, 0.98);
    EXPECT_LT(std::abs(accuracy.bias_mm), 0.1);
    EXPECT_LT(accuracy.mean_mm, 0.15);
  }
}

TEST(Threshold, TheLargestBoneWithoutSeeds) {
  const Pair pair;
  const auto fields = segmented::fields(kNode, pair.volume(), {}, {{"threshold_hu", 550.0}});
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields.name(0), "bone");
  EXPECT_GT(bones::compare(fields[0], [&](const Vector3d& p) { return pair.second(p); }).dice, 0.98);
}

TEST(Threshold, TouchingFragmentsAreSharedOutHalfway) {
  const Grid grid = bones::ct_grid({24, 24, 41});
  const auto rod = [](const Vector3d& p) { return std::hypot(p.x(), p.y()) - 6; };
  const Volume volume = bones::scan(
      grid, [&](const Vector3d& p) { return 1000 * bones::filled(rod(p)); }, 0.5, 0, 1);
  List<Seeds> seeds;
  seeds.add("low", Seeds{"low", {{0, 0, -15}}, false});
  seeds.add("high", Seeds{"high", {{0, 0, 15}}});
  const auto fields = segmented::fields(kNode, volume, seeds, {{"threshold_hu", 500.0}});
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields.name(0), "high");
  EXPECT_LT(sample_trilinear(grid, fields[0].values_mm, grid.index_from_point({0, 0, 2})), 0);
  EXPECT_GT(sample_trilinear(grid, fields[0].values_mm, grid.index_from_point({0, 0, -2})), 0);
}

TEST(Threshold, ASeedInSparseSpongyBoneIsGoodBesideOneInCortex) {
  Volume volume{bones::ct_grid({24, 24, 24}), {}};
  volume.values.assign(volume.grid.count(), 200.f);
  const double middle = 0.5 * (volume.grid.size[2] - 1);
  for (int z = 0; z < volume.grid.size[2]; ++z)
    for (int y = 0; y < volume.grid.size[1]; ++y)
      for (int x = 0; x < volume.grid.size[0]; ++x)
        if (z > middle + 2) volume.values[volume.grid.offset(x, y, z)] = 1200;
  const auto at_height = [&](double z) -> Vector3d { return volume.grid.origin_mm + Vector3d(8, 8, z); };
  List<Seeds> seeds;
  seeds.add("distal", Seeds{"distal", {at_height(4), at_height(20)}});
  const auto fields = segmented::fields(kNode, volume, seeds);
  EXPECT_LT(sample_trilinear(volume.grid, fields[0].values_mm, volume.grid.index_from_point(at_height(20))), 0);
  EXPECT_GT(sample_trilinear(volume.grid, fields[0].values_mm, volume.grid.index_from_point(at_height(4))), 0);
  List<Seeds> only_spongy;
  only_spongy.add("distal", Seeds{"distal", {at_height(4)}});
  EXPECT_EQ(refusal(kNode, segmented::inputs(volume, only_spongy)),
            "seeds of fragment 'distal': none of them lies in bone of 250 HU or more that no other fragment has taken; "
            "add a point in cortical bone, or lower threshold_hu");
}

// What the level set is for: level_set_test.cpp segments the same CT to 0.1 mm. (Higher thresholds find no spongy bone
// at all.)
TEST(Threshold, NoThresholdSegmentsADistalEnd) {
  const bones::DistalEnd bone;
  const Volume volume = bone.scan_of({128, 128, 192}, 40);
  const auto seeds = bone.seeds();
  double least_mm = 1e9;
  for (const double threshold_hu : {160.0, 200.0, 250.0}) {
    const auto fields = segmented::fields(kNode, volume, seeds, {{"threshold_hu", threshold_hu}});
    double worst_mm = 0;
    for (std::size_t f = 0; f < 2; ++f) {
      const auto accuracy = bones::compare(
          fields[f], [&](const Vector3d& p) { return bone.distance(p, f == 0 ? 1 : -1); },
          [](const Vector3d& p) { return p.z() < 90; });
      worst_mm = std::max(worst_mm, accuracy.mean_mm);
    }
    least_mm = std::min(least_mm, worst_mm);
  }
  EXPECT_GT(least_mm, 0.3);
}

TEST(Threshold, SaysWhenThereIsNoBone) {
  const Volume volume{bones::ct_grid({8, 8, 8}), std::vector<float>(512, 30.f)};
  EXPECT_EQ(refusal(kNode, {{"volume", item(volume)}}),
            "volume: no voxel reaches the threshold of 250 HU, so there is no bone; lower threshold_hu, and check that "
            "the CT is in Hounsfield units");
}

}  // namespace marrow::test::threshold_test
