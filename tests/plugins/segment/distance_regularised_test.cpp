// SPDX-License-Identifier: Apache-2.0
#include "plugins/segment/distance_regularised.cpp"

#include <gtest/gtest.h>

#include "tests/plugins/segment/broken_tube.hpp"

namespace {

TEST(DistanceRegularised, TwoFragmentsOneMillimetreApart) {
  const phantom::BrokenTube tube;
  Context context;
  phantom::expect_both(tube, distance_regularised(tube.volume(), tube.seeds(), {}, context));
}

TEST(DistanceRegularised, ItsOwnRegularityKeepsTheSlopeNearOne) {
  const phantom::BrokenTube tube;
  const Volume volume = tube.volume();
  const Options options;
  const auto owner = marrow::segment::race(volume, marrow::segment::seed_indices(volume, tube.seeds(), 150), {});
  const auto mask = marrow::segment::solid(volume.grid, owner, 0, 10);
  Evolution evolution(volume, mask, owner, 0, options);
  Context context;
  evolution.run(context);
  const Grid grid = marrow::segment::grid_of(volume.grid, mask);
  double sum = 0, count = 0;
  for (int z = 12; z < grid.size[2] - 12; ++z)
    for (int y = 4; y < grid.size[1] - 4; ++y)
      for (int x = 4; x < grid.size[0] - 4; ++x) {
        const auto& phi = evolution.phi();
        if (std::abs(phi[grid.offset(x, y, z)]) > 0.7) continue;
        const auto slope = [&](int i, int j, int k) {
          return (phi[grid.offset(x + i, y + j, z + k)] - phi[grid.offset(x - i, y - j, z - k)]) / 2;
        };
        sum += std::sqrt(std::pow(slope(1, 0, 0), 2) + std::pow(slope(0, 1, 0), 2) + std::pow(slope(0, 0, 1) * 0.8, 2));
        ++count;
      }
  std::printf("mean |grad phi| at the surface %.3f\n", sum / count);
  EXPECT_NEAR(sum / count, 1, 0.25);
}

TEST(DistanceRegularised, GivesOnlyWantedFragments) {
  const phantom::BrokenTube tube;
  Context context;
  const auto fields = distance_regularised(tube.volume(), tube.seeds(false), {}, context);
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields.name(0), "distal");
}

}  // namespace
