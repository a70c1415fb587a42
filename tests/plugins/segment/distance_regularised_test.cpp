// SPDX-License-Identifier: Apache-2.0
#include "plugins/segment/distance_regularised.cpp"

#include "tests/plugins/segment/phantom.hpp"

namespace marrow::test::distance_regularised_test {

TEST(DistanceRegularised, ItsOwnRegularityKeepsTheSlopeNearOne) {
  const bones::BrokenTube tube;
  const Volume volume = tube.volume();
  const ::Options options;
  const auto owner = segment::race(volume, segment::seed_indices(volume, tube.seeds(), 150), {});
  const auto mask = segment::solid(volume.grid, owner, 0, 10);
  Evolution evolution(volume, mask, owner, 0, options);
  Context context;
  evolution.run(context);
  const Grid grid = segment::grid_of(volume.grid, mask);
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
  EXPECT_NEAR(sum / count, 1, 0.25);
}

}  // namespace marrow::test::distance_regularised_test
