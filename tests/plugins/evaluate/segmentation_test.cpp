// SPDX-License-Identifier: Apache-2.0
// How well segmentations and surfaces agree, and how bones touch, of boxes and balls.
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::segmentation_test {

/// A box from `low` to `high` on a grid whose voxels begin at the origin.
SignedField box_field(const std::array<int, 3>& size, double spacing_mm, const Vector3d& low, const Vector3d& high) {
  return field_by(grid_at(size, Vector3d::Constant(0.5 * spacing_mm), Vector3d::Constant(spacing_mm)),
                  [&](const Vector3d& p) { return (low - p).cwiseMax(p - high).maxCoeff(); });
}
Inputs compared(const SignedField& field, const SignedField& reference) {
  return {{"field", item(field)}, {"reference", item(reference)}};
}
Value dice(const SignedField& field, const SignedField& reference) {
  return call("evaluate.dice", compared(field, reference)).at("metrics");
}
const SignedField kCoarse = box_field({16, 10, 10}, 1, {2, 2, 2}, {10, 8, 8}),
                  kFine = box_field({40, 20, 20}, 0.5, {2, 2, 2}, {10, 8, 8});

TEST(Dice, OfShiftedBoxes) {
  // 8 x 6 x 6 voxels each, 6 x 6 x 6 in common: 2 * 216 / (288 + 288), 216 / 360.
  const auto metrics = dice(kCoarse, box_field({16, 10, 10}, 1, {4, 2, 2}, {12, 8, 8}));
  expect_figures(metrics, {{"dice", 0.75}, {"jaccard", 0.6}}, 1e-12);
  expect_figures(metrics, {{"volume_mm3", 288}, {"reference_mm3", 288}}, 1e-9);
}

TEST(Dice, IsOneOfTheSameAndZeroOfApart) {
  EXPECT_EQ(figure(dice(kCoarse, kCoarse), "dice"), 1);
  EXPECT_EQ(figure(dice(kCoarse, box_field({16, 10, 10}, 1, {11, 2, 2}, {14, 8, 8})), "dice"), 0);
}

TEST(Dice, OnAnotherGrid) {
  // The same box in voxels of half the size, and on a larger grid: each voxel of the first finds it where it is.
  EXPECT_NEAR(figure(dice(kCoarse, kFine), "dice"), 1, 1e-12);
  EXPECT_NEAR(figure(dice(kFine, kCoarse), "dice"), 1, 0.002) << "of coarse samples, the corners are rounded";
}

TEST(Dice, WhatTheGridDoesNotShowCountsAsMissed) {
  // The first grid ends at x = 8: 6 x 6 x 6 voxels of it are inside; the reference has 2 x 6 x 6 more beyond.
  const auto metrics = dice(box_field({8, 10, 10}, 1, {2, 2, 2}, {10, 8, 8}), kCoarse);
  expect_figures(metrics, {{"volume_mm3", 216}, {"reference_mm3", 288}}, 1e-9);
  expect_figures(metrics, {{"dice", 2 * 216.0 / (216 + 288)}}, 1e-12);
}

TEST(Dice, SaysWhatIsWrong) {
  const auto refusal = [](const SignedField& field, const SignedField& reference) {
    return shipped::refusal("evaluate.dice", compared(field, reference));
  };
  const auto cube = box_field({8, 8, 8}, 1, {2, 2, 2}, {6, 6, 6}),
             none = box_field({8, 8, 8}, 1, {20, 2, 2}, {26, 6, 6});
  EXPECT_EQ(refusal(none, none),
            "neither the field nor the reference has an inside, so there is nothing to compare; inside is where values "
            "are negative");
  SignedField other = cube;
  other.grid.frame = "mri";
  EXPECT_EQ(refusal(cube, other),
            "the field is in the frame 'ct', but the reference in 'mri'; compare segmentations of the same CT");
  other = cube;
  other.values_mm.pop_back();
  EXPECT_EQ(refusal(other, cube), "field: 512 voxels expected from its size, got 511");
}

Inputs meshes(const Mesh& mesh, const Mesh& reference) {
  return {{"mesh", item(mesh)}, {"reference", item(reference)}};
}
Value distance(const Mesh& mesh, const Mesh& reference) {
  return call("evaluate.surface_distance", meshes(mesh, reference)).at("metrics");
}
double bias_mm(const Mesh& mesh, const Mesh& reference) { return figure(distance(mesh, reference), "bias_mm"); }

Mesh inside_out(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

/// A ball: the faces of a box, each cut into 40 x 40 parts, drawn to the sphere. The parts share no vertices.
Mesh ball(double radius_mm) {
  constexpr int kParts = 40;
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1})
      for (int i = 0; i < kParts; ++i)
        for (int j = 0; j < kParts; ++j) {
          const auto first = std::uint32_t(mesh.vertices_mm.size());
          for (const auto& [a, b] : {std::pair{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}) {
            Vector3d p;
            p[axis] = side;
            p[(axis + 1) % 3] = side * std::tan(kPi / 4 * (2.0 * a / kParts - 1));
            p[(axis + 2) % 3] = std::tan(kPi / 4 * (2.0 * b / kParts - 1));
            mesh.vertices_mm.push_back(radius_mm * p.normalized());
          }
          mesh.triangles.push_back({first, first + 1, first + 2});
          mesh.triangles.push_back({first, first + 2, first + 3});
        }
  return mesh;
}

TEST(SurfaceDistance, IsZeroOfTheSame) {
  expect_figures(distance(box({1, 2, 3}, {20, 30, 60}), box({1, 2, 3}, {20, 30, 60})),
                 {{"mean_mm", 0}, {"rms_mm", 0}, {"p95_mm", 0}, {"max_mm", 0}, {"bias_mm", 0}}, 1e-9);
}

TEST(SurfaceDistance, OfConcentricBalls) {
  // Of radii 20 and 22: flat triangles lie up to 0.01 mm below the spheres.
  expect_figures(distance(ball(22), ball(20)),
                 {{"mean_mm", 2}, {"rms_mm", 2}, {"p95_mm", 2}, {"max_mm", 2}, {"bias_mm", 2}}, 0.012);
  EXPECT_NEAR(bias_mm(ball(20), ball(22)), -2, 0.012) << "too small";
}

TEST(SurfaceDistance, AnInsideOutReferenceHasTheSameBias) {
  const Mesh larger = box({0, 0, 0}, {22, 22, 42}), reference = box({0, 0, 0}, {20, 20, 40});
  const double right_mm = bias_mm(larger, reference);
  EXPECT_GT(right_mm, 0.9);
  EXPECT_NEAR(bias_mm(larger, inside_out(reference)), right_mm, 1e-9);
  EXPECT_NEAR(bias_mm(ball(22), inside_out(ball(20))), 2, 0.012) << "its patches share no vertices";
  Heard heard;
  call("evaluate.surface_distance", meshes(larger, inside_out(reference)), {}, heard.context);
  EXPECT_EQ(heard.lines, Strings{"the triangles of the reference face inwards; bias_mm takes them as facing outwards"});
}

TEST(SurfaceDistance, OfBoxesOfWhichOneIsLonger) {
  // 20 x 20 x 40 in 20 x 20 x 46. The longer one's ends (areas 400) lie 3 mm off the shorter one, and the parts of its
  // sides that stick out (20 x 3, four times at each end) lie 0 to 3 mm off it: 2 * (400 * 3 + 240 * 1.5) over its area
  // of 4480. The shorter one's ends lie 3 mm off, or m mm where a side is nearer: 14 * 14 * 3 + the integral of m * 4
  // (20 - 2 m) from 0 to 3, 288; squared 14 * 14 * 9 + 558.
  const auto metrics = distance(box({0, 0, 0}, {20, 20, 46}), box({0, 0, 0}, {20, 20, 40}));
  const double longer = 2 * (400 * 3 + 240 * 1.5) / 4480, shorter = 2 * (196 * 3 + 288) / 4000.0;
  expect_figures(metrics,
                 {{"mean_mm", 0.5 * (longer + shorter)},
                  {"bias_mm", longer},
                  {"rms_mm", std::sqrt(0.5 * (2 * (400 * 9 + 240 * 3) / 4480.0 + 2 * (196 * 9 + 558) / 4000.0))}},
                 0.005);
  expect_figures(metrics, {{"max_mm", 3}, {"p95_mm", 3}}, 1e-9);
}

TEST(SurfaceDistance, TheLargestIsFoundAtAVertexToo) {
  // A needle of 30 mm on one face has hardly any area, so hardly a point is spread over it.
  Mesh needle = box({0, 0, 0}, {20, 20, 20});
  const auto tip = std::uint32_t(needle.vertices_mm.size());
  needle.vertices_mm.insert(needle.vertices_mm.end(), {{0, 0, 40}, {0, 0.0001, 10}, {0.0001, 0, 10}});
  needle.triangles.push_back({tip, tip + 1, tip + 2});
  const auto metrics = distance(needle, box({0, 0, 0}, {20, 20, 20}));
  EXPECT_NEAR(figure(metrics, "max_mm"), 30, 1e-9);
  EXPECT_LT(figure(metrics, "mean_mm"), 1e-3);
}

TEST(SurfaceDistance, SaysWhatIsWrong) {
  const Mesh cube = box({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(refusal("evaluate.surface_distance", meshes(cube, {})), "reference: the surface has no triangles");
  Mesh other = cube;
  other.frame = "world";
  EXPECT_EQ(
      refusal("evaluate.surface_distance", meshes(other, cube)),
      "the mesh is in the frame 'world', but the reference in 'ct'; move one of them into the frame of the other");
}

/// Balls of 10 mm radius, one at the origin, the other with its middle at x.
Inputs balls(double x_mm) {
  const analytic::Body body{{{0, 0, 0}, {10, 10, 10}}};
  const Mesh model = mesh_of(body);
  const SignedField field = field_of(body, analytic::grid_of({61, 61, 61}, {0.5, 0.5, 0.5}), 4);
  return {{"poses", per_fragment("a", pose_at({0, 0, 0}), "b", pose_at({x_mm, 0, 0}))},
          {"models", per_fragment("a", model, "b", model)},
          {"fields", per_fragment("a", field, "b", field)}};
}

TEST(Contact, PenetrationAndGapOfTwoBalls) {
  for (const double gap_mm : {-2.0, -0.5, 1.0, 3.0}) {
    const Value metrics = call("evaluate.contact", balls(20 + gap_mm)).at("metrics");
    EXPECT_NEAR(figure(metrics, "a.b.penetration_mm"), std::max(0.0, -gap_mm), 0.1) << gap_mm;
    EXPECT_NEAR(figure(metrics, "a.b.gap_mm"), gap_mm + 0.15, 0.15) << gap_mm;  // within the weights' fall of 0.2 mm
  }
}

TEST(Contact, RefusesOneBoneAndABoneWithoutAField) {
  EXPECT_EQ(refusal("evaluate.contact", with(balls(20), {{"poses", per_fragment("a", Pose())}})),
            "there are fewer than two bones, so nothing can touch; give the poses of two at least");
  EXPECT_EQ(refusal("evaluate.contact", with(balls(20), {{"poses", per_fragment("a", Pose(), "c", Pose())}})),
            "poses has the bone 'c', but models has not; give all of them for the same fragments");
}

}  // namespace marrow::test::segmentation_test
