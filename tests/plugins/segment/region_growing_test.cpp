// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/segment/broken_tube.hpp"
#include "tests/plugins/segment/segmented.hpp"

namespace marrow::test::region_growing_test {

constexpr const char* kNode = "segment.region_growing";

TEST(RegionGrowing, TwoFragmentsOneMillimetreApart) {
  const bones::BrokenTube tube;
  bones::expect_both(tube, segmented::fields(kNode, tube.volume(), tube.seeds(), {{"threshold_hu", 650.0}}));
}

TEST(RegionGrowing, GivesOnlyWantedFragmentsAndKeepsThemFromTheOthersBone) {
  const bones::BrokenTube tube;
  const auto both = segmented::fields(kNode, tube.volume(), tube.seeds());
  const auto one = segmented::fields(kNode, tube.volume(), tube.seeds(false));
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one.name(0), "distal");
  std::size_t different = 0;  // both may fill the same voxel of the gap
  for (std::size_t at = 0; at < one[0].values_mm.size(); ++at)
    different += (one[0].values_mm[at] < 0) != (both[1].values_mm[at] < 0);
  EXPECT_LT(different, 10u);
}

TEST(RegionGrowing, SaysWhatIsWrongWithSeeds) {
  const bones::BrokenTube tube;
  List<Seeds> seeds;
  seeds.add("distal", Seeds{"distal", {{0, 0, -15}}});
  const std::string text = refusal(kNode, segmented::inputs(tube.volume(), seeds));
  EXPECT_NE(text.find("is not in bone"), std::string::npos) << text;
}

}  // namespace marrow::test::region_growing_test
