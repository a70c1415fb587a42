// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shapes.hpp"
#include "shipped.hpp"

namespace whole_test {

using namespace marrow;
using phantom::Phantom;
namespace test = phantom::test;

Phantom whole(const phantom::Bone& bone, const shipped::Options& options) {
  return shipped::call("simulate.whole", {{"bone", shipped::item(bone)}}, options).at("phantom").as<Phantom>();
}

TEST(SimulateWhole, MovesTheBoneAboutItsOwnAxes) {
  phantom::Bone bone;
  bone.outer = test::box({10, 0, 0}, {30, 10, 100});
  bone.outer.frame = "bone";
  const Phantom phantom =
      whole(bone, {{"rotation_deg", std::vector<double>{0, 0, 90}}, {"translation_mm", std::vector<double>{1, 2, 3}}});
  ASSERT_EQ(phantom.fragments.size(), 1u);
  const phantom::Fragment& fragment = phantom.fragments[0];
  EXPECT_EQ(fragment.name, "bone");
  EXPECT_EQ(fragment.side, 0);
  // The middle of the box is at (20, 5, 50); a point 10 mm beside it in x comes to lie beside it in y.
  EXPECT_LT((fragment.world_from_ct * Eigen::Vector3d(20, 5, 50) - Eigen::Vector3d(21, 7, 53)).norm(), 1e-9);
  EXPECT_LT((fragment.world_from_ct * Eigen::Vector3d(30, 5, 50) - Eigen::Vector3d(21, 17, 53)).norm(), 1e-9);
  EXPECT_EQ(fragment.outer.vertices_mm, bone.outer.vertices_mm);
  EXPECT_EQ(fragment.outer.frame, "ct");
}

TEST(SimulateWhole, SeedsLieInTheCortexAtAllHeights) {
  phantom::Bone bone;
  bone.outer = test::cylinder(15, 0, 140);
  bone.inner = test::cylinder(11, 4, 136);
  bone.outer.frame = bone.inner.frame = "bone";
  const Phantom phantom = whole(bone, {});
  const auto& seeds = phantom.fragments[0].seeds_mm;
  ASSERT_EQ(seeds.size(), 14u);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NEAR(seeds[i].z(), 5 + 10 * double(i), 1e-9);
    const double radius = seeds[i].head<2>().norm();
    EXPECT_TRUE(radius > 11 && radius < 15) << radius;
  }
}

TEST(SimulateWhole, RefusesAnOpenSurface) {
  phantom::Bone bone;
  bone.outer = test::box({0, 0, 0}, {10, 10, 10});
  bone.outer.triangles.pop_back();
  EXPECT_NE(shipped::refusal("simulate.whole", {{"bone", shipped::item(bone)}})
                .find("simulate.whole, outer surface: the surface is open"),
            std::string::npos);
}

}  // namespace whole_test
