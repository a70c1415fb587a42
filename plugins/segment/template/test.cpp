// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, FindsTheSurfacesOfTwoBalls) {
  constexpr double kRadius_mm = 8;
  const Eigen::Vector3d centres[2] = {{20, 20, 45}, {20, 20, 15}};
  marrow::Volume volume;
  volume.grid.size = {41, 41, 61};
  for (int z = 0; z < 61; ++z)
    for (int y = 0; y < 41; ++y)
      for (int x = 0; x < 41; ++x) {
        const Eigen::Vector3d p(x, y, z);
        const double outside = std::min((p - centres[0]).norm(), (p - centres[1]).norm()) - kRadius_mm;
        volume.values.push_back(float(40 + 420 * std::clamp(0.5 - outside, 0.0, 1.0)));  // bone in soft tissue
      }
  marrow::List<marrow::Seeds> seeds;
  seeds.add("proximal", {"proximal", {centres[0]}, true});
  seeds.add("distal", {"distal", {centres[1]}, true});
  const auto fields = node_test::call("segment.new_node", {{"volume", node_test::item(volume)},
                                                           {"seeds", node_test::list(seeds, "fragment")}})
                          .at("field")
                          .as_list<marrow::SignedField>();
  ASSERT_EQ(fields.size(), 2u);
  for (std::size_t f = 0; f < 2; ++f) {
    const auto distance_at = [&](double x) { return fields[f].at(int(x), 20, int(centres[f].z())); };
    EXPECT_LT(distance_at(20), 0);
    for (const double x : {20 - kRadius_mm, 20 + kRadius_mm}) EXPECT_NEAR(distance_at(x), 0, 0.5);
    EXPECT_GT(fields[f].at(20, 20, int(centres[1 - f].z())), 0) << "the other fragment is outside";
  }
}
