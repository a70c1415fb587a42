// SPDX-License-Identifier: Apache-2.0
// Rays through closed surfaces compared with chords that are known exactly, and the polygoniser that makes the
// surfaces.
#include "marrow/simulate/solid.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::rays_test {

using namespace marrow::phantom;
using namespace simulated;

/// Length of bone on the ray of each pixel: {cortical, inner}.
std::vector<std::array<double, 2>> lengths(const Phantom& phantom, const Camera& camera) {
  const SolidRays rays(phantom, camera.width_px, camera.height_px, [&](const Fragment& fragment) {
    return [&camera, camera_from_bone = camera.camera_from_world * fragment.world_from_bone()](const Vector3d& p) {
      const Vector3d x = camera_from_bone * p;
      const Vector3d pixel = camera.intrinsics * x / x.z();
      return RayVertex{pixel.x(), pixel.y(), -1 / x.z()};
    };
  });
  std::vector<std::array<double, 2>> result(std::size_t(camera.width_px) * std::size_t(camera.height_px), {0, 0});
  const auto crossings = rays.bundle().crossings(0, camera.height_px);
  for_each_ray(crossings, [&](std::span<const Crossing> ray) {
    EXPECT_EQ(ray.size() % 2, 0u);
    std::vector<Interval> intervals;
    rays.intervals(ray, intervals);
    const Vector3d along = camera.intrinsics.inverse() * Vector3d(ray[0].column, ray[0].row, 1);
    for (const Interval& i : intervals)
      result[ray[0].row * std::size_t(camera.width_px) + ray[0].column][i.cortical ? 0 : 1] +=
          (1 / i.from - 1 / i.to) * along.norm();
  });
  return result;
}

/// Chord of a ray through a turned box, computed from its slabs and not from triangles.
double box_chord(const Vector3d& source, const Vector3d& direction, const Vector3d& low, const Vector3d& high) {
  double from = -1e300, to = 1e300;
  for (int k = 0; k < 3; ++k) {
    const double a = (low[k] - source[k]) / direction[k], b = (high[k] - source[k]) / direction[k];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return std::max(0.0, to - from) * direction.norm();
}

TEST(Rays, TurnedBoxHasItsChordsToAMillionth) {
  const Vector3d low(-20, -10, -30), high(15, 25, 40);
  Phantom phantom = simulated::whole(box_between(low, high));
  phantom.fragments[0].world_from_ct = placed({4, -3, 2}, {0.3, -0.5, 0.7});
  const Camera camera = simulated::camera(20, 200);
  const auto measured = lengths(phantom, camera);
  const RigidTransform bone_from_world = inverse(phantom.fragments[0].world_from_bone());
  int off = 0, inside = 0;
  for (int v = 0; v < 200; ++v)
    for (int u = 0; u < 200; ++u) {
      const double expected =
          box_chord(bone_from_world * source_position_mm(camera),
                    bone_from_world.rotation * ray_direction(camera, {double(u), double(v)}), low, high);
      const double got = measured[std::size_t(v) * 200 + std::size_t(u)][0];
      inside += expected > 0;
      // A ray that meets the silhouette within 1/4096 of a pixel may fall to either side of it.
      off += std::abs(got - expected) > 1e-6 && expected > 0.02;
      EXPECT_NEAR(got, expected, expected > 0.02 ? 0.05 : 0.03);
    }
  EXPECT_GT(inside, 3000);
  EXPECT_EQ(off, 0);
}

TEST(Rays, SphereAndHollowCylinderHaveTheirChords) {
  const Camera camera = simulated::camera(0, 128);
  const auto ball = lengths(simulated::whole(simulated::sphere({5, 3, -8}, 30, 0.7)), camera);
  const auto tube = lengths(simulated::whole(upright_cylinder(20, -300, 300), upright_cylinder(8, -290, 290)), camera);
  for (int v = 4; v < 128; v += 9)
    for (int u = 3; u < 128; u += 7) {
      const Vector3d source = source_position_mm(camera), direction = ray_direction(camera, {double(u), double(v)});
      const double miss = (Vector3d(5, 3, -8) - source).cross(direction).norm();
      if (std::abs(miss - 30) > 1) {
        EXPECT_NEAR(ball[std::size_t(v) * 128 + std::size_t(u)][0], miss < 30 ? 2 * std::sqrt(900 - miss * miss) : 0.0,
                    0.08);
      }
      const auto chord = [&](double radius) {
        const auto [from, to] = through_cylinder({0, 0}, radius, source, direction);
        return to - from;
      };
      const double off_axis = std::abs(direction.x() * 600 / direction.head<2>().norm());
      if (std::abs(off_axis - 20) < 0.5 || std::abs(off_axis - 8) < 0.5) continue;
      EXPECT_NEAR(tube[std::size_t(v) * 128 + std::size_t(u)][0], chord(20) - chord(8), 0.01);
      EXPECT_NEAR(tube[std::size_t(v) * 128 + std::size_t(u)][1], chord(8), 0.01);
    }
}

TEST(Rays, CylinderFormulaAgreesWithAChordByHand) {
  // At 12 mm from the axis of a cylinder of radius 20 a perpendicular ray runs 2 sqrt(400 - 144) = 32 mm.
  const auto [from, to] = through_cylinder({0, 5}, 20, {12, -595, 7}, {0, 1, 0});
  EXPECT_NEAR(to - from, 32, 1e-9);
  EXPECT_NEAR(from, 584, 1e-9);
}

TEST(Rays, RaysThroughEdgesAndCornersMeetEachSurfaceTwice) {
  // A box whose corners, edges and diagonals lie exactly on rays.
  RayBundle rays(12, 12);
  const Mesh box = box_between({2, 3, 1}, {9, 8, 5});
  std::vector<RayVertex> vertices;
  for (const auto& p : box.vertices_mm) vertices.push_back({p.x(), p.y(), p.z()});
  rays.add(vertices, box.triangles);
  const auto crossings = rays.crossings(0, 12);
  std::size_t hit = 0;
  for_each_ray(crossings, [&](std::span<const Crossing> ray) {
    ++hit;
    ASSERT_EQ(ray.size(), 2u);
    EXPECT_EQ(ray[0].sense, 1);
    EXPECT_EQ(ray[1].sense, -1);
    EXPECT_EQ(ray[0].depth, 1);
    EXPECT_EQ(ray[1].depth, 5);
  });
  EXPECT_EQ(hit, 7u * 5u);  // half-open: one of two opposite sides belongs to it
}

TEST(Polygonise, SphereIsClosedOutwardAndHasItsVolume) {
  const Mesh ball = simulated::sphere({1, 2, 3}, 20, 0.9);
  EXPECT_TRUE(is_closed(ball));
  EXPECT_NEAR(enclosed_volume_mm3(ball) / (4.0 / 3 * kPi * 8000), 1, 2e-3);
  for (const auto& vertex : ball.vertices_mm) EXPECT_NEAR((vertex - Vector3d(1, 2, 3)).norm(), 20, 0.02);
}

TEST(Fill, MeanOverALineIsExact) {
  Bone bone;
  bone.fill_z_mm = {0, 10, 30};
  bone.fill_fraction = {0.4, 0.2, 0};
  const Fill fill(bone);
  EXPECT_NEAR(fill.at(5), 0.3, 1e-12);
  EXPECT_NEAR(fill.mean(0, 10), 0.3, 1e-12);
  EXPECT_NEAR(fill.mean(0, 30), (3.0 + 2.0) / 30, 1e-12);
  EXPECT_NEAR(fill.mean(30, 0), (3.0 + 2.0) / 30, 1e-12);
  EXPECT_NEAR(fill.mean(-10, 10), 0.35, 1e-12);
  EXPECT_NEAR(fill.mean(4, 4 + 1e-6), 0.32, 1e-6);
}

}  // namespace marrow::test::rays_test
