// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"

namespace surface_distance_test {

using Eigen::Vector3d;
using marrow::test::box;

marrow::Value distance(const marrow::Mesh& mesh, const marrow::Mesh& reference) {
  return shipped::call("evaluate.surface_distance",
                       {{"mesh", shipped::item(mesh)}, {"reference", shipped::item(reference)}})
      .at("metrics");
}

/// A ball: the faces of a box, each cut into `parts` x `parts`, drawn to the sphere.
marrow::Mesh ball(double radius_mm, int parts) {
  marrow::Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1})
      for (int i = 0; i < parts; ++i)
        for (int j = 0; j < parts; ++j) {
          const auto first = std::uint32_t(mesh.vertices_mm.size());
          for (const auto& [a, b] : {std::pair{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}) {
            Vector3d p;
            p[axis] = side;
            p[(axis + 1) % 3] = side * std::tan(marrow::kPi / 4 * (2.0 * a / parts - 1));
            p[(axis + 2) % 3] = std::tan(marrow::kPi / 4 * (2.0 * b / parts - 1));
            mesh.vertices_mm.push_back(radius_mm * p.normalized());
          }
          mesh.triangles.push_back({first, first + 1, first + 2});
          mesh.triangles.push_back({first, first + 2, first + 3});
        }
  return mesh;
}

TEST(SurfaceDistance, IsZeroOfTheSame) {
  const auto metrics = distance(box({1, 2, 3}, {20, 30, 60}), box({1, 2, 3}, {20, 30, 60}));
  for (const char* name : {"mean_mm", "rms_mm", "p95_mm", "max_mm", "bias_mm"})
    EXPECT_NEAR(shipped::figure(metrics, name), 0, 1e-9) << name;
}

TEST(SurfaceDistance, OfConcentricBalls) {
  // Of radii 20 and 22, in 40 x 40 patches a face: flat triangles lie up to 0.01 mm below the spheres.
  const auto metrics = distance(ball(22, 40), ball(20, 40));
  for (const char* name : {"mean_mm", "rms_mm", "p95_mm", "max_mm"})
    EXPECT_NEAR(shipped::figure(metrics, name), 2, 0.012) << name;
  EXPECT_NEAR(shipped::figure(metrics, "bias_mm"), 2, 0.012);
  EXPECT_NEAR(shipped::figure(distance(ball(20, 40), ball(22, 40)), "bias_mm"), -2, 0.012) << "too small";
}

TEST(SurfaceDistance, AnInsideOutReferenceHasTheSameBias) {
  marrow::Mesh reference = box({0, 0, 0}, {20, 20, 40}), soup = ball(20, 40);
  const marrow::Mesh larger = box({0, 0, 0}, {22, 22, 42});
  const double right = shipped::figure(distance(larger, reference), "bias_mm");
  EXPECT_GT(right, 0.9);
  for (auto& t : reference.triangles) std::swap(t[0], t[1]);
  for (auto& t : soup.triangles) std::swap(t[0], t[1]);
  EXPECT_NEAR(shipped::figure(distance(larger, reference), "bias_mm"), right, 1e-9);
  EXPECT_NEAR(shipped::figure(distance(ball(22, 40), soup), "bias_mm"), 2, 0.012) << "its patches share no vertices";
  std::vector<std::string> lines;
  marrow::Context::Hooks hooks;
  hooks.log = [&](std::string_view text, marrow::LogLevel) { lines.emplace_back(text); };
  shipped::call("evaluate.surface_distance", {{"mesh", shipped::item(larger)}, {"reference", shipped::item(reference)}},
                {}, marrow::Context(hooks));
  EXPECT_EQ(lines, std::vector<std::string>{
                       "the triangles of the reference face inwards; bias_mm takes them as facing outwards"});
}

TEST(SurfaceDistance, OfBoxesOfWhichOneIsLonger) {
  // 20 x 20 x 40 in 20 x 20 x 46. The longer one's ends (areas 400) lie 3 mm off the shorter one, and the parts of its
  // sides that stick out (20 x 3, four times at each end) lie 0 to 3 mm off it: 2 * (400 * 3 + 240 * 1.5) over its area
  // of 4480. The shorter one's ends lie 3 mm off, or m mm where a side is nearer: 14 * 14 * 3 + the integral of m * 4
  // (20 - 2 m) from 0 to 3, 288; squared 14 * 14 * 9 + 558.
  const auto metrics = distance(box({0, 0, 0}, {20, 20, 46}), box({0, 0, 0}, {20, 20, 40}));
  const double longer = 2 * (400 * 3 + 240 * 1.5) / 4480, shorter = 2 * (196 * 3 + 288) / 4000.0;
  EXPECT_NEAR(shipped::figure(metrics, "mean_mm"), 0.5 * (longer + shorter), 0.005);
  EXPECT_NEAR(shipped::figure(metrics, "bias_mm"), longer, 0.005);
  EXPECT_NEAR(shipped::figure(metrics, "rms_mm"),
              std::sqrt(0.5 * (2 * (400 * 9 + 240 * 3) / 4480.0 + 2 * (196 * 9 + 558) / 4000.0)), 0.005);
  EXPECT_NEAR(shipped::figure(metrics, "max_mm"), 3, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "p95_mm"), 3, 1e-9);
}

TEST(SurfaceDistance, TheLargestIsFoundAtAVertexToo) {
  // A needle of 30 mm on one face has hardly any area, so hardly a point is spread over it.
  marrow::Mesh needle = box({0, 0, 0}, {20, 20, 20});
  const auto tip = std::uint32_t(needle.vertices_mm.size());
  needle.vertices_mm.insert(needle.vertices_mm.end(), {{0, 0, 40}, {0, 0.0001, 10}, {0.0001, 0, 10}});
  needle.triangles.push_back({tip, tip + 1, tip + 2});
  const auto metrics = distance(needle, box({0, 0, 0}, {20, 20, 20}));
  EXPECT_NEAR(shipped::figure(metrics, "max_mm"), 30, 1e-9);
  EXPECT_LT(shipped::figure(metrics, "mean_mm"), 1e-3);
}

TEST(SurfaceDistance, SaysWhatIsWrong) {
  const auto refusal = [](const marrow::Mesh& mesh, const marrow::Mesh& reference) {
    return shipped::refusal("evaluate.surface_distance",
                            {{"mesh", shipped::item(mesh)}, {"reference", shipped::item(reference)}});
  };
  EXPECT_EQ(refusal(box({0, 0, 0}, {1, 1, 1}), {}), "reference: the surface has no triangles");
  marrow::Mesh other = box({0, 0, 0}, {1, 1, 1});
  other.frame = "world";
  EXPECT_EQ(
      refusal(other, box({0, 0, 0}, {1, 1, 1})),
      "the mesh is in the frame 'world', but the reference in 'ct'; move one of them into the frame of the other");
}

}  // namespace surface_distance_test
