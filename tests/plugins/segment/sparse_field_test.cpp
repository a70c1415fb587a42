// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/segment/broken_tube.hpp"
#include "tests/plugins/segment/segmented.hpp"

namespace marrow::test::sparse_field_test {

constexpr const char* kNode = "segment.sparse_field";

TEST(SparseField, TwoFragmentsOneMillimetreApart) {
  const bones::BrokenTube tube;
  bones::expect_both(tube, segmented::fields(kNode, tube.volume(), tube.seeds()));
}

TEST(SparseField, GivesOnlyWantedFragments) {
  const bones::BrokenTube tube;
  const auto fields = segmented::fields(kNode, tube.volume(), tube.seeds(false));
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields.name(0), "distal");
}

TEST(SparseField, SaysWhenTheVolumeIsTooThin) {
  const Volume volume{bones::ct_grid({20, 20, 3}), std::vector<float>(1200, 900.f)};
  List<Seeds> seeds;
  seeds.add("distal", Seeds{"distal", {{0, 0, 0}}});
  EXPECT_EQ(refusal(kNode, segmented::inputs(volume, seeds)),
            "volume: at least 4 voxels along each axis expected, got 3");
}

}  // namespace marrow::test::sparse_field_test
