// SPDX-License-Identifier: Apache-2.0
#include "plugins/segment/region_growing.cpp"

#include <gtest/gtest.h>

#include "segment/broken_tube.hpp"

namespace {

TEST(RegionGrowing, TwoFragmentsOneMillimetreApart) {
  const phantom::BrokenTube tube;
  Context context;
  phantom::expect_both(tube, region_growing(tube.volume(), tube.seeds(), {.least_hu = 650}, context));
}

TEST(RegionGrowing, GivesOnlyWantedFragmentsAndKeepsThemFromTheOthersBone) {
  const phantom::BrokenTube tube;
  Context context;
  const auto both = region_growing(tube.volume(), tube.seeds(), {}, context);
  const auto one = region_growing(tube.volume(), tube.seeds(false), {}, context);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one.name(0), "distal");
  std::size_t different = 0;  // both may fill the same voxel of the gap
  for (std::size_t at = 0; at < one[0].values_mm.size(); ++at)
    different += (one[0].values_mm[at] < 0) != (both[1].values_mm[at] < 0);
  EXPECT_LT(different, 10u);
}

TEST(RegionGrowing, SaysWhatIsWrongWithSeeds) {
  const phantom::BrokenTube tube;
  List<Seeds> seeds;
  seeds.add("distal", Seeds{"distal", {{0, 0, -15}}});
  Context context;
  try {
    region_growing(tube.volume(), seeds, {}, context);
    FAIL() << "no error";
  } catch (const marrow::Error& error) {
    EXPECT_NE(std::string(error.what()).find("is not in bone"), std::string::npos) << error.what();
  }
}

}  // namespace
