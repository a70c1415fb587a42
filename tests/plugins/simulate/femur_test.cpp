// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "nodes.hpp"
#include "shapes.hpp"

namespace femur_test {

using namespace marrow;
using phantom::Bone;
namespace test = phantom::test;

shipped::Options coarse() { return {{"resolution_mm", 2.0}, {"ripple_mm", 0.0}}; }

struct Extent {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = Eigen::Vector3d::Constant(-1e9);
  Eigen::Vector3d size() const { return high - low; }
};
/// The extent of the vertices between two fractions of the length from the distal end.
Extent extent(const Mesh& mesh, double from, double to) {
  Extent all, part;
  for (const auto& p : mesh.vertices_mm) all.low = all.low.cwiseMin(p), all.high = all.high.cwiseMax(p);
  for (const auto& p : mesh.vertices_mm) {
    const double at = (p.z() - all.low.z()) / all.size().z();
    if (at < from || at > to) continue;
    part.low = part.low.cwiseMin(p);
    part.high = part.high.cwiseMax(p);
  }
  return part;
}

TEST(SimulateFemur, HasTheMeasuresItIsMadeFrom) {
  const Bone bone = simulated::femur(coarse());
  EXPECT_TRUE(is_closed(bone.outer));
  EXPECT_TRUE(is_closed(bone.inner));
  EXPECT_NEAR(extent(bone.outer, 0, 1).size().z(), 446, 3);
  EXPECT_NEAR(extent(bone.outer, 0, 0.15).size().x(), 82, 3);
  EXPECT_NEAR(extent(bone.outer, 0.46, 0.49).size().x(), 28, 1);
  EXPECT_NEAR(extent(bone.outer, 0.46, 0.49).size().y(), 30, 1.5);
  EXPECT_NEAR(extent(bone.inner, 0.46, 0.49).size().x(), 12.3, 0.8);
  EXPECT_NEAR(extent(bone.outer, 0, 1).low.z(), -70, 0.5);
  // The head of a left femur points to the patient's right and to the front: a sphere around its centre fits its top.
  const Extent top = extent(bone.outer, 0.97, 1);
  EXPECT_LT(top.high.x(), -20);
}

TEST(SimulateFemur, CondylesTellItsAxialRotation) {
  const Bone bone = simulated::femur(coarse());
  // Two condyles with a notch behind: at 5 % of the length no surface lies behind the middle, but much beside it.
  const Extent all = extent(bone.outer, 0.03, 0.05);
  double behind_middle = -1e9, behind = -1e9;
  for (const auto& p : bone.outer.vertices_mm) {
    if (p.z() > -70 + 0.05 * 446) continue;
    behind = std::max(behind, p.y());
    if (std::abs(p.x() - 0.5 * (all.low.x() + all.high.x())) < 4) behind_middle = std::max(behind_middle, p.y());
  }
  EXPECT_GT(behind - behind_middle, 15);
}

TEST(SimulateFemur, RightIsTheMirrorImageOfLeft) {
  shipped::Options options = coarse();
  const Bone left = simulated::femur(options);
  options["side"] = std::string("right");
  const Bone right = simulated::femur(options);
  EXPECT_NEAR(enclosed_volume_mm3(left.outer) / enclosed_volume_mm3(right.outer), 1, 1e-3);
  EXPECT_NEAR(extent(left.outer, 0, 1).low.x(), -extent(right.outer, 0, 1).high.x(), 1);
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
