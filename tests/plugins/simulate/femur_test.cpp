// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "nodes.hpp"
#include "shapes.hpp"

namespace femur_test {

using namespace marrow;
using phantom::Bone;
namespace test = phantom::test;

shipped::Options coarse() { return {{"resolution_mm", 2.0}, {"ripple_mm", 0.0}}; }

/// The extent of the vertices between two fractions of the length from the distal end.
Eigen::AlignedBox3d extent(const Mesh& mesh, double from, double to) {
  const Eigen::AlignedBox3d all = test::extent(mesh, [](const auto&) { return true; });
  return test::extent(mesh, [&](const auto& p) {
    const double at = (p.z() - all.min().z()) / all.sizes().z();
    return at >= from && at <= to;
  });
}

TEST(SimulateFemur, HasTheMeasuresItIsMadeFrom) {
  const Bone bone = simulated::femur(coarse());
  EXPECT_TRUE(is_closed(bone.outer));
  EXPECT_TRUE(is_closed(bone.inner));
  EXPECT_NEAR(extent(bone.outer, 0, 1).sizes().z(), 446, 3);
  EXPECT_NEAR(extent(bone.outer, 0, 0.15).sizes().x(), 82, 3);
  EXPECT_NEAR(extent(bone.outer, 0.46, 0.49).sizes().x(), 28, 1);
  EXPECT_NEAR(extent(bone.outer, 0.46, 0.49).sizes().y(), 30, 1.5);
  EXPECT_NEAR(extent(bone.inner, 0.46, 0.49).sizes().x(), 12.3, 0.8);
  EXPECT_NEAR(extent(bone.outer, 0, 1).min().z(), -70, 0.5);
  // The head of a left femur points to the patient's right and to the front: a sphere around its centre fits its top.
  const Eigen::AlignedBox3d top = extent(bone.outer, 0.97, 1);
  EXPECT_LT(top.max().x(), -20);
}

TEST(SimulateFemur, CondylesTellItsAxialRotation) {
  const Bone bone = simulated::femur(coarse());
  // Two condyles with a notch behind: at 5 % of the length no surface lies behind the middle, but much beside it.
  const Eigen::AlignedBox3d all = extent(bone.outer, 0.03, 0.05);
  double behind_middle = -1e9, behind = -1e9;
  for (const auto& p : bone.outer.vertices_mm) {
    if (p.z() > -70 + 0.05 * 446) continue;
    behind = std::max(behind, p.y());
    if (std::abs(p.x() - 0.5 * (all.min().x() + all.max().x())) < 4) behind_middle = std::max(behind_middle, p.y());
  }
  EXPECT_GT(behind - behind_middle, 15);
}

TEST(SimulateFemur, RightIsTheMirrorImageOfLeft) {
  shipped::Options options = coarse();
  const Bone left = simulated::femur(options);
  options["side"] = std::string("right");
  const Bone right = simulated::femur(options);
  EXPECT_NEAR(enclosed_volume_mm3(left.outer) / enclosed_volume_mm3(right.outer), 1, 1e-3);
  EXPECT_NEAR(extent(left.outer, 0, 1).min().x(), -extent(right.outer, 0, 1).max().x(), 1);
}

TEST(SimulateFemur, ShapeSeedAndVariationGiveOtherBonesAndNothingElseDoes) {
  shipped::Options options = coarse();
  options["resolution_mm"] = 3.0;
  options["variation"] = 1.0;
  const Bone a = simulated::femur(options, 1), b = simulated::femur(options, 2);
  EXPECT_EQ(a.outer.vertices_mm, b.outer.vertices_mm);  // the run's seed is for noise only
  options["shape_seed"] = std::int64_t{2};
  const Bone c = simulated::femur(options, 1);
  EXPECT_NE(a.outer.vertices_mm.size(), c.outer.vertices_mm.size());
  for (int seed = 3; seed < 9; ++seed) {
    options["shape_seed"] = std::int64_t{seed};
    EXPECT_TRUE(is_closed(simulated::femur(options, 1).outer)) << seed;
  }
}

TEST(SimulateFemur, ThinShaftIsExplained) {
  shipped::Options options = coarse();
  options["canal_diameter_mm"] = 26.0;
  EXPECT_EQ(marrow::test::message_of([&] { simulated::femur(options); }),
            "simulate.femur: a canal of 26.000000 mm leaves less than 2 mm of cortex in a shaft of 28.000000 mm; make "
            "the canal narrower");
}

}  // namespace femur_test
