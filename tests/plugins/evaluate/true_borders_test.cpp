// SPDX-License-Identifier: Apache-2.0
// Cylinders, cones and boxes, whose borders are known exactly. An error of 1 % of the width would be 0.28 mm.
#include "plugins/evaluate/true_borders.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/evaluate/cone.hpp"

namespace marrow::test::true_borders_test {

using tube::posed;

constexpr double kRadius_mm = 14, kPixel_mm = 0.6 * 300 / 512;  // at the isocentre
constexpr double kLimit_mm = 0.01;

Mesh cylinder(double half_mm = 150) {
  return tube::mesh(
      half_mm, [](double, double) { return kRadius_mm; }, [](double) { return Vector3d(0, 0, 0); }, 360, 60);
}

/// The farthest that an end of one segment is from the line through the other, in mm at the isocentre.
double apart_mm(const LineSegment& one, const LineSegment& other) {
  const Vector2d way = (other.to_px - other.from_px).normalized();
  const auto off = [&](const Vector2d& p) {
    return std::abs(way.x() * (p - other.from_px).y() - way.y() * (p - other.from_px).x());
  };
  return kPixel_mm * std::max(off(one.from_px), off(one.to_px));
}
double worst_mm(const true_borders::Borders& borders, const ShaftLines& exact) {
  return std::max(apart_mm(borders.left, exact.left), apart_mm(borders.right, exact.right));
}

TEST(TrueBorders, OfACylinderAreTheLinesThatTouchIt) {
  const Mesh model = cylinder();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  double worst = 0;
  for (int i = 0; i < 40; ++i) {
    const Camera camera = radiograph::camera(180 * unit(random));
    const RigidTransform pose = posed({15 * unit(random), 15 * unit(random), 90 * unit(random)},
                                      {30 * unit(random), 30 * unit(random), 20 * unit(random)});
    const ShaftLines exact = tube::borders(camera, pose.translation_mm, pose.rotation.col(2), kRadius_mm, 100, 400);
    const auto borders = true_borders::borders_beside(exact, model, pose, camera, 1);
    ASSERT_TRUE(borders);
    worst = std::max(worst, worst_mm(*borders, exact));
    const Vector2d between = 0.5 * (exact.right.from_px + exact.right.to_px - exact.left.from_px - exact.left.to_px);
    const Vector2d along =
        (exact.left.from_px + exact.right.from_px - exact.left.to_px - exact.right.to_px).normalized();
    EXPECT_NEAR(kPixel_mm * borders->width_px, kPixel_mm * std::abs(along.x() * between.y() - along.y() * between.x()),
                kLimit_mm);
  }
  std::printf("cylinders: off by %.5f mm at most\n", worst);
  EXPECT_LT(worst, kLimit_mm);
}

TEST(TrueBorders, OfAConeAreTheLinesThatTouchIt) {
  for (const double slope : {-0.08, -0.03, 0.03, 0.08}) {
    const Mesh model = tube::mesh(
        150, [=](double z, double) { return kRadius_mm + slope * z; }, [](double) { return Vector3d(0, 0, 0); }, 360,
        60);
    for (const double angle : {0.0, 35.0, 90.0}) {
      const Camera camera = radiograph::camera(angle);
      const RigidTransform pose = posed({8, -6, 20}, {12, -25, 5});
      const cone::Cone known{pose * Vector3d(0, 0, -kRadius_mm / slope), (slope > 0 ? 1 : -1) * pose.rotation.col(2),
                             std::atan(std::abs(slope))};
      const ShaftLines exact = cone::borders(camera, known, 120, 380);
      const auto borders = true_borders::borders_beside(exact, model, pose, camera, 1);
      ASSERT_TRUE(borders);
      EXPECT_LT(worst_mm(*borders, exact), kLimit_mm) << slope << ", " << angle;
    }
  }
}

// Those of a box are the images of its edges, to the last digits.
TEST(TrueBorders, OfABoxAreItsEdges) {
  const Camera camera = radiograph::camera(0);  // along +y
  const Mesh model = box({0, 0, 0}, {20, 30, 200});
  const auto edge = [&](double x) {
    return LineSegment{project(camera, {x, -15, 50}), project(camera, {x, -15, -50})};
  };
  ShaftLines edges;
  edges.left = edge(10), edges.right = edge(-10);  // they run down
  const auto borders = true_borders::borders_beside(edges, model, posed({0, 0, 0}, {0, 0, 0}), camera, 3 * kPixel_mm);
  ASSERT_TRUE(borders);
  EXPECT_LT(worst_mm(*borders, edges), 1e-9);
  EXPECT_NEAR(borders->width_px, 20 * camera.intrinsics(0, 0) / 585, 1e-9);
}

TEST(TrueBorders, DoNotDependOnThePairBeside) {
  const Camera camera = radiograph::camera(0);
  const RigidTransform pose = posed({5, -4, 0}, {6, -9, 0});
  const ShaftLines exact = tube::borders(camera, pose.translation_mm, pose.rotation.col(2), kRadius_mm, 100, 400);
  for (const double turn_deg : {-3.0, 0.0, 3.0})
    for (const double shift_px : {-20.0, 20.0}) {
      ShaftLines pair = exact;
      for (LineSegment* border : {&pair.left, &pair.right})
        for (Vector2d* end : {&border->from_px, &border->to_px})
          *end = Eigen::Rotation2Dd(radians(turn_deg)) * (*end - Vector2d(256, 256)) + Vector2d(256 + shift_px, 256);
      const auto borders = true_borders::borders_beside(pair, cylinder(), pose, camera, 3 * kPixel_mm);
      ASSERT_TRUE(borders);
      EXPECT_LT(worst_mm(*borders, exact), kLimit_mm);
    }
}

// A fragment's surface ends where it broke, and all vertices of the bone may still be in its list. In the last pixels
// before an end that leans, the outline is that of the break.
TEST(TrueBorders, OfASurfaceThatEndsAreThoseOfItsPart) {
  const Camera camera = radiograph::camera(90);
  const RigidTransform pose = posed({3, 7, 0}, {4, 5, 0});
  const ShaftLines exact = tube::borders(camera, pose.translation_mm, pose.rotation.col(2), kRadius_mm, 100, 400);
  Mesh part = cylinder();
  std::erase_if(part.triangles, [&](const auto& t) { return part.vertices_mm[t[0]].z() > 10; });
  const auto borders = true_borders::borders_beside(exact, part, pose, camera, 3 * kPixel_mm);
  ASSERT_TRUE(borders);
  EXPECT_LT(worst_mm(*borders, exact), 0.05);
}

TEST(TrueBorders, WhatFlaresFartherThanTheToleranceIsNoShaft) {
  const Mesh model = tube::mesh(
      100, [](double z, double) { return kRadius_mm + std::max(0.0, z - 30); },
      [](double) { return Vector3d(0, 0, 0); }, 360, 400);
  const Camera camera = radiograph::camera(0);
  const ShaftLines exact = tube::borders(camera, {0, 0, 0}, {0, 0, 1}, kRadius_mm, 140, 400);  // z up to 41 mm
  const RigidTransform pose = posed({0, 0, 0}, {0, 0, 0});
  const auto within = [&](double tolerance_mm) {
    return worst_mm(*true_borders::borders_beside(exact, model, pose, camera, tolerance_mm), exact);
  };
  std::printf("a flare of 45 degrees: off by %.3f mm, without tolerance %.3f mm\n", within(1), within(100));
  EXPECT_LT(within(1), 0.1);
  EXPECT_GT(within(100), 1);
}

TEST(TrueBorders, NeedTheSurfaceInAThirdOfTheStretch) {
  const Camera camera = radiograph::camera(0);
  const ShaftLines pair = tube::borders(camera, {0, 0, 0}, {0, 0, 1}, kRadius_mm, 56, 456);  // 140.6 mm
  const auto shown = [&](double half_mm, const Vector3d& at) {
    return true_borders::borders_beside(pair, cylinder(half_mm), posed({0, 0, 0}, at), camera, 3 * kPixel_mm)
        .has_value();
  };
  EXPECT_TRUE(shown(25, {0, 0, 0}));
  EXPECT_FALSE(shown(22, {0, 0, 0}));
  EXPECT_FALSE(shown(100, {0, 0, 300}));
  EXPECT_FALSE(shown(100, {0, -1000, 0}));  // behind the source
  EXPECT_FALSE(true_borders::borders_beside({}, cylinder(), posed({0, 0, 0}, {0, 0, 0}), camera, 3 * kPixel_mm));
}

}  // namespace marrow::test::true_borders_test
