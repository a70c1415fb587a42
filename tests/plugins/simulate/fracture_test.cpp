// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "nodes.hpp"
#include "shapes.hpp"

namespace fracture_test {

using namespace marrow;
using phantom::Bone, phantom::Fragment, phantom::Phantom;
namespace test = phantom::test;

Bone shaft() {
  Bone bone;
  // Rings of corners along the cylinder, so that its triangles are small against the fracture.
  bone.outer = phantom::polygonise(
      [](const Eigen::Vector3d& p) { return std::max(std::hypot(p.x() - 3, p.y()) - 14, std::abs(p.z()) - 100); },
      {-20, -20, -104}, {26, 20, 104}, 1.1, 1.5);
  bone.inner = phantom::polygonise(
      [](const Eigen::Vector3d& p) { return std::max(std::hypot(p.x() - 3, p.y()) - 6, std::abs(p.z()) - 94); },
      {-20, -20, -104}, {26, 20, 104}, 1.1, 1.5);
  return bone;
}

/// Points of the surface along which a bone breaks, on a raster. The floor of the block below lies 5 mm deeper.
std::vector<Eigen::Vector3d> relief(const Bone& bone, const shipped::Options& options) {
  std::vector<Eigen::Vector3d> points = simulated::fracture(bone, options).fracture.vertices_mm;
  double floor = 1e9;
  for (const auto& point : points) floor = std::min(floor, point.z());
  std::erase_if(points, [&](const auto& point) { return point.z() < floor + 2; });
  EXPECT_GT(points.size(), 1000u);
  return points;
}

TEST(SimulateFracture, CentreOfAnOutlineIsExact) {
  const Bone bone = shaft();
  double low = 1e9, high = -1e9;
  for (const auto& vertex : bone.outer.vertices_mm) low = std::min(low, vertex.z()), high = std::max(high, vertex.z());
  // A smooth fracture contains the centre of the outline at its height. Here it rises by 1 mm per mm.
  shipped::Options options{
      {"height_fraction", (12.34 - low) / (high - low)}, {"obliquity_deg", 45.0}, {"roughness_mm", 0.0}};
  options["direction_deg"] = 0.0;
  for (const auto& point : relief(bone, options)) ASSERT_NEAR(point.x() - (point.z() - 12.34), 3, 0.02);
  options["direction_deg"] = 90.0;
  for (const auto& point : relief(bone, options)) ASSERT_NEAR(point.y() - (point.z() - 12.34), 0, 0.02);
}

TEST(SimulateFracture, CutsAtItsLevelWithItsObliquity) {
  const Phantom phantom = simulated::fracture(
      shaft(), {{"height_fraction", 0.4}, {"obliquity_deg", 30.0}, {"direction_deg", 0.0}, {"roughness_mm", 0.0}});
  EXPECT_TRUE(is_closed(phantom.fracture));
  EXPECT_GT(enclosed_volume_mm3(phantom.fracture), 0);
  double below = -1e9, above = 1e9;  // the surface's height at the axis and 10 mm to the left
  for (const auto& vertex : phantom.fracture.vertices_mm) {
    if (std::hypot(vertex.x() - 3, vertex.y()) < 0.6) below = std::max(below, vertex.z());
    if (std::hypot(vertex.x() - 13, vertex.y()) < 0.6) above = std::min(above, vertex.z() > -100 ? vertex.z() : 1e9);
  }
  EXPECT_NEAR(below, -100 + 0.4 * 200, 0.6);
  EXPECT_NEAR(above, -20 + 10 * std::tan(kPi / 6), 0.6);
}

TEST(SimulateFracture, RoughnessIsItsRootMeanSquareAndItsSeedChangesIt) {
  Bone block;  // much wider than the longest waves of the relief, 40 mm
  block.outer = test::box({-60, -60, -100}, {60, 60, 100});
  shipped::Options options{{"obliquity_deg", 0.0}, {"roughness_mm", 1.5}, {"height_fraction", 0.5}};
  const auto surface = [&](int seed) {
    options["fracture_seed"] = std::int64_t{seed};
    return relief(block, options);
  };
  double squares = 0;
  std::size_t count = 0;
  for (int seed = 1; seed <= 40; ++seed)
    for (const auto& point : surface(seed)) squares += point.z() * point.z(), ++count;
  EXPECT_NEAR(std::sqrt(squares / double(count)), 1.5, 0.1);
  const auto one = surface(1), two = surface(2);
  ASSERT_EQ(one.size(), two.size());
  const std::size_t middle = one.size() / 2;
  EXPECT_EQ(one[middle].head<2>(), two[middle].head<2>());
  EXPECT_NE(one[middle].z(), two[middle].z());
}

TEST(SimulateFracture, MotionIsAboutTheFragmentsOwnAxes) {
  const Phantom phantom = simulated::fracture(shaft(), {{"rotation_deg", std::vector<double>{2, -3, 40}},
                                                        {"translation_mm", std::vector<double>{4, 5, -6}},
                                                        {"ct_gap_mm", std::vector<double>{0.5, 0, -2}}});
  ASSERT_EQ(phantom.fragments.size(), 2u);
  EXPECT_EQ(phantom.fragments[0].name, "proximal");
  EXPECT_EQ(phantom.fragments[1].name, "distal");
  const Fragment& distal = phantom.fragments[1];
  const Vector6d motion = motion_between(RigidTransform{"world", "ct"}, distal.world_from_ct, distal.frame);
  const Vector6d expected = (Vector6d() << radians(2), radians(-3), radians(40), 4, 5, -6).finished();
  EXPECT_LT((motion - expected).norm(), 1e-9);
  // The distal shaft reaches from -100 to -10 (level 0.45): its wall of 7917 mm2 around -55 and its cap of 616 mm2 at
  // -100 have their centre at -58.2, and the gap is 2. The cut rises by tan 30 cos 30 = 0.5 along x, which moves the
  // centre of the wall by 0.5 14^2 / (2 90) = 0.54; its share is 0.93.
  EXPECT_NEAR(distal.frame.origin_mm.z(), -58.2 - 2, 0.3);
  EXPECT_NEAR(distal.frame.origin_mm.x(), 3.5 + 0.5, 0.05);
  EXPECT_NEAR(distal.frame.axes(2, 2), 1, 2e-3);
  EXPECT_EQ(distal.ct_from_bone.translation_mm, Eigen::Vector3d(0.5, 0, -2));
  EXPECT_EQ(phantom.fragments[0].world_from_ct.translation_mm, Eigen::Vector3d::Zero());
  EXPECT_EQ(phantom.fragments[0].world_from_ct.rotation, Eigen::Matrix3d::Identity());
}

TEST(SimulateFracture, SeedsLieInTheirOwnFragmentsCortex) {
  const Phantom phantom = simulated::fracture(shaft(), {{"ct_gap_mm", std::vector<double>{0, 0, -2}}});
  for (const Fragment& fragment : phantom.fragments) {
    EXPECT_GE(fragment.seeds_mm.size(), 8u) << fragment.name;
    for (const auto& seed : fragment.seeds_mm) {
      const Eigen::Vector3d in_bone = inverse(fragment.ct_from_bone) * seed;
      const double radius = std::hypot(in_bone.x() - 3, in_bone.y());
      EXPECT_GT(radius, 8);
      EXPECT_LT(radius, 12);
      const double height = in_bone.z() + 10;  // over the fracture's centre; at radius 12 it rises by 7 mm
      if (fragment.side < 0)
        EXPECT_LT(height, 11);
      else
        EXPECT_GT(height, -11);
    }
  }
}

TEST(SimulateFracture, BadInputIsExplained) {
  Bone open = shaft();
  open.outer.triangles.pop_back();
  EXPECT_EQ(marrow::test::message_of([&] { simulated::fracture(open, {}); }),
            "simulate.fracture, outer surface: the surface is open or not consistently oriented, so it has no inside; "
            "close its "
            "holes (each edge must be shared by exactly two triangles)");
  Bone inward = shaft();
  for (auto& triangle : inward.outer.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_NE(marrow::test::message_of([&] { simulated::fracture(inward, {}); }).find("the triangles face inward"),
            std::string::npos);
  Bone few = shaft();
  few.fill_fraction = {0.1, 0.2};
  EXPECT_EQ(marrow::test::message_of([&] { simulated::fracture(few, {}); }),
            "simulate.fracture: the bone share needs as many positions as values, got 1 and 2");
  EXPECT_EQ(marrow::test::message_of([] {
              simulated::fracture(shaft(), {{"height_fraction", 1.2}});
            }),
            "simulate.fracture: the height_fraction 1.200000 must lie in 0.1 to 0.9 of the bone's length");
}

}  // namespace fracture_test
