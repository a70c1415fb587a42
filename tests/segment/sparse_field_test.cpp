// SPDX-License-Identifier: Apache-2.0
#include "plugins/segment/sparse_field.cpp"

#include <gtest/gtest.h>

#include "segment/broken_tube.hpp"

namespace {

TEST(SparseField, TwoFragmentsOneMillimetreApart) {
  const phantom::BrokenTube tube;
  Context context;
  phantom::expect_both(tube, sparse_field(tube.volume(), tube.seeds(), {}, context));
}

TEST(SparseField, GivesOnlyWantedFragments) {
  const phantom::BrokenTube tube;
  Context context;
  const auto fields = sparse_field(tube.volume(), tube.seeds(false), {}, context);
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields.name(0), "distal");
}

TEST(SparseField, SaysWhenTheVolumeIsTooThin) {
  marrow::Volume volume{phantom::ct_grid({20, 20, 3}), std::vector<float>(1200, 900.f)};
  List<Seeds> seeds;
  seeds.add("distal", Seeds{"distal", {{0, 0, 0}}});
  Context context;
  try {
    sparse_field(volume, seeds, {}, context);
    FAIL() << "no error";
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(error.what(), "volume: at least 4 voxels along each axis expected, got 3");
  }
}

}  // namespace
