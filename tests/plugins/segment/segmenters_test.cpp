// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/phantom/phantom.hpp"
#include "tests/plugins/segment/phantom.hpp"

namespace marrow::test::segmenters_test {

/// The nodes that grow fragments from seeds, each with what it needs for these.
class Segmenter : public testing::TestWithParam<std::string> {
 protected:
  static List<SignedField> fields(const bones::BrokenTube& tube, bool both_wanted) {
    const Options options = GetParam() == "region_growing" ? Options{{"threshold_hu", 650.0}} : Options{};
    return segmented::fields("segment." + GetParam(), tube.volume(), tube.seeds(both_wanted), options);
  }
};
INSTANTIATE_TEST_SUITE_P(, Segmenter, testing::Values("distance_regularised", "region_growing", "sparse_field"),
                         [](const auto& node) { return node.param; });

TEST_P(Segmenter, TwoFragmentsOneMillimetreApart) {
  const bones::BrokenTube tube;
  bones::expect_both(tube, fields(tube, true));
}

TEST_P(Segmenter, GivesOnlyWantedFragments) {
  const auto one = fields({}, false);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one.name(0), "distal");
}

TEST(RegionGrowing, KeepsWantedFragmentsFromTheOthersBone) {
  const bones::BrokenTube tube;
  const auto both = segmented::fields("segment.region_growing", tube.volume(), tube.seeds());
  const auto one = segmented::fields("segment.region_growing", tube.volume(), tube.seeds(false));
  std::size_t different = 0;  // both may fill the same voxel of the gap
  for (std::size_t at = 0; at < one[0].values_mm.size(); ++at)
    different += (one[0].values_mm[at] < 0) != (both[1].values_mm[at] < 0);
  EXPECT_LT(different, 10u);
}

TEST(RegionGrowing, SaysWhatIsWrongWithSeeds) {
  const bones::BrokenTube tube;
  const List<Seeds> seeds = named("distal", Seeds{"distal", {{0, 0, -15}}});
  const std::string text = refusal("segment.region_growing", segmented::inputs(tube.volume(), seeds));
  EXPECT_HAS(text, "is not in bone");
}

TEST(SparseField, SaysWhenTheVolumeIsTooThin) {
  const Volume volume{bones::ct_grid({20, 20, 3}), std::vector<float>(1200, 900.f)};
  const List<Seeds> seeds = named("distal", Seeds{"distal", {{0, 0, 0}}});
  EXPECT_EQ(refusal("segment.sparse_field", segmented::inputs(volume, seeds)),
            "volume: at least 4 voxels along each axis expected, got 3");
}

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
  const List<Seeds> seeds =
      named("proximal", Seeds{"proximal", {{10.5, 0, 16}}}, "distal", Seeds{"distal", {{9.5, 0, -19}}});
  const auto fields = segmented::fields("segment.threshold", pair.volume(), seeds, {{"threshold_hu", 550.0}});
  ASSERT_EQ(fields.size(), 2u);
  bones::expect_within(bones::compare(fields[0], [&](const Vector3d& p) { return pair.second(p); }), 0.98, 0.1, 0.15);
  bones::expect_within(bones::compare(fields[1], [&](const Vector3d& p) { return pair.first(p); }), 0.98, 0.1, 0.15);
}

TEST(Threshold, TheLargestBoneWithoutSeeds) {
  const Pair pair;
  const auto fields = segmented::fields("segment.threshold", pair.volume(), {}, {{"threshold_hu", 550.0}});
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields.name(0), "bone");
  EXPECT_GT(bones::compare(fields[0], [&](const Vector3d& p) { return pair.second(p); }).dice, 0.98);
}

TEST(Threshold, TouchingFragmentsAreSharedOutHalfway) {
  const Grid grid = bones::ct_grid({24, 24, 41});
  const auto rod = [](const Vector3d& p) { return std::hypot(p.x(), p.y()) - 6; };
  const Volume volume = bones::scan(
      grid, [&](const Vector3d& p) { return 1000 * bones::filled(rod(p)); }, 0.5, 0, 1);
  const List<Seeds> seeds = named("low", Seeds{"low", {{0, 0, -15}}, false}, "high", Seeds{"high", {{0, 0, 15}}});
  const auto fields = segmented::fields("segment.threshold", volume, seeds, {{"threshold_hu", 500.0}});
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
  const List<Seeds> seeds = named("distal", Seeds{"distal", {at_height(4), at_height(20)}});
  const auto fields = segmented::fields("segment.threshold", volume, seeds);
  EXPECT_LT(sample_trilinear(volume.grid, fields[0].values_mm, volume.grid.index_from_point(at_height(20))), 0);
  EXPECT_GT(sample_trilinear(volume.grid, fields[0].values_mm, volume.grid.index_from_point(at_height(4))), 0);
  const List<Seeds> only_spongy = named("distal", Seeds{"distal", {at_height(4)}});
  EXPECT_EQ(refusal("segment.threshold", segmented::inputs(volume, only_spongy)),
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
    const auto fields = segmented::fields("segment.threshold", volume, seeds, {{"threshold_hu", threshold_hu}});
    least_mm = std::min(least_mm, std::max(bone.compare(fields, 0).mean_mm, bone.compare(fields, 1).mean_mm));
  }
  EXPECT_GT(least_mm, 0.3);
}

TEST(Threshold, SaysWhenThereIsNoBone) {
  const Volume volume{bones::ct_grid({8, 8, 8}), std::vector<float>(512, 30.f)};
  EXPECT_EQ(refusal("segment.threshold", {{"volume", item(volume)}}),
            "volume: no voxel reaches the threshold of 250 HU, so there is no bone; lower threshold_hu, and check that "
            "the CT is in Hounsfield units");
}

/// A bone with ends that are not round, so that it lies one way only, in two fragments of a known displacement.
struct Bone {
  double gap_mm = 0, turned_deg = 0, aside_mm = 0;

  static double whole(const Vector3d& p) {
    const double shaft = bones::round_cone(p, {0, 0, -25}, {0, 0, 25}, 8, 7),
                 head = bones::round_cone(p, {0, 0, 25}, {8, 0, 30}, 9, 7);
    const double foot = bones::round_cone(p, {-5, -4, -25}, {6, 2, -27}, 9, 9);
    return std::min({shaft, head, foot});
  }
  Vector3d in_distal(const Vector3d& p) const {
    return Eigen::AngleAxisd(-turned_deg * M_PI / 180, Vector3d::UnitX()) * (p - Vector3d(0, aside_mm, 0));
  }
  Vector3d out_of_distal(const Vector3d& p) const {
    return Eigen::AngleAxisd(turned_deg * M_PI / 180, Vector3d::UnitX()) * p + Vector3d(0, aside_mm, 0);
  }
  double distance(const Vector3d& p, std::size_t fragment) const {
    if (fragment == 0) return std::max(whole(p), 0.5 * gap_mm - p.z());
    const Vector3d q = in_distal(p);
    return std::max(whole(q), q.z() + 0.5 * gap_mm);
  }
  Volume volume() const {
    return bones::scan(
        bones::ct_grid({52, 60, 96}),
        [&](const Vector3d& p) {
          return 50 + 900 * std::min(1.0, bones::filled(distance(p, 0)) + bones::filled(distance(p, 1)));
        },
        0.5, 30, 9);
  }
  List<Seeds> seeds() const {
    return named("proximal", Seeds{"proximal", {{0, 0, 10}, {0, 0, 25}}}, "distal",
                 Seeds{"distal", {out_of_distal({0, 0, -10}), out_of_distal({0, 0, -25})}});
  }
};

/// The whole bone's surface: each point of a sphere moved along its ray from the middle line.
Mesh template_mesh(double scale, const Vector3d& shift) {
  const auto surface = [&](double t, double angle) -> Vector3d {
    const Vector3d middle(0, 0, -25 + 50 * std::clamp(t, 0.0, 1.0));
    const double tilt = t < 0 ? t : t > 1 ? t - 1 : 0;  // beyond the ends the rays turn to the poles
    const Vector3d ray =
        Vector3d(std::cos(angle) * std::cos(tilt), std::sin(angle) * std::cos(tilt), std::sin(tilt)).normalized();
    double low = 0, high = 40;
    for (int i = 0; i < 40; ++i) (Bone::whole(middle + 0.5 * (low + high) * ray) < 0 ? low : high) = 0.5 * (low + high);
    return scale * (middle + low * ray) + shift;
  };
  constexpr int kRings = 60, kAround = 48;
  std::vector<marrow::phantom::Points> rings(kRings - 1);
  for (int i = 1; i < kRings; ++i)
    for (int j = 0; j < kAround; ++j)
      rings[std::size_t(i - 1)].push_back(surface(-M_PI / 2 + (1 + M_PI) * i / kRings, 2 * M_PI * j / kAround));
  return marrow::phantom::loft(rings);
}

Inputs inputs(const Bone& bone, const Mesh& whole) {
  Inputs inputs = segmented::inputs(bone.volume(), bone.seeds());
  inputs["template"] = item(whole);
  return inputs;
}

std::array<bones::Accuracy, 2> accuracy_of(const Bone& bone) {
  const auto fields =
      output_list<SignedField>("segment.atlas", "field", inputs(bone, template_mesh(1.15, {30, -20, 12})));
  EXPECT_EQ(fields.size(), 2u);
  EXPECT_EQ(bones::overlap(fields), 0u);
  std::array<bones::Accuracy, 2> accuracies;
  for (std::size_t f = 0; f < 2; ++f) {
    accuracies[f] = bones::compare(
        fields[f], [&](const Vector3d& p) { return bone.distance(p, f); },
        [&](const Vector3d& p) { return std::abs(p.z()) > 6; });
  }
  return accuracies;
}

TEST(Atlas, FindsTheSameBoneOfAnotherSizeElsewhere) {
  for (const auto& accuracy : accuracy_of({})) {
    EXPECT_GT(accuracy.dice, 0.95);
    EXPECT_LT(accuracy.mean_mm, 0.6);
  }
}

// The chapter: segmentation by an atlas fails on fractures. The level set, on the same CT, does not.
TEST(Atlas, FailsOnADisplacedFracture) {
  const Bone broken{.gap_mm = 3, .turned_deg = 18, .aside_mm = 9};
  const auto accuracies = accuracy_of(broken);
  EXPECT_LT(std::min(accuracies[0].dice, accuracies[1].dice), 0.9);
  EXPECT_GT(std::max(accuracies[0].mean_mm, accuracies[1].mean_mm), 1.0);
}

TEST(Atlas, WantsAClosedTemplate) {
  Mesh open = template_mesh(1, Vector3d::Zero());
  open.triangles.pop_back();
  EXPECT_EQ(refusal("segment.atlas", inputs({}, open)),
            "template: a closed surface expected, got one with holes; its inside is not defined");
}

}  // namespace marrow::test::segmenters_test
