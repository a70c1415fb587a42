// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/similarity/blob_scene.hpp"

namespace marrow::test::drr_edges_test {

using blob_scene::at;

constexpr const char* kNode = "similarity.drr_edges";

/// A wall through (100 + x, 80) with this normal. Rays beyond it cross it. Its border is blurred by an error function.
Value wall(const DrawnRadiograph::Region& region, const Vector2d& normal) {
  return function<RadiographProjector>(
      std::make_shared<const DrawnRadiograph>(region, [=](const Vector2d& pixel, const RigidTransform& pose) {
        const double across_px = normal.dot(pixel - Vector2d(100 + pose.translation_mm.x(), 80));
        return 20 + 20 * std::erf(across_px / (std::sqrt(2.0) * 2.5));
      }));
}
PixelGrid beside_the_wall(const RigidTransform& pose) {
  return std::abs(pose.translation_mm.x()) < 60 ? PixelGrid{60, 20, 1, 80, 130} : PixelGrid{};
}

/// An upright wall that is brighter on the left, as its edges are.
Inputs inputs(const EdgeMap& edges) {
  return {{"projector", wall(beside_the_wall, {1, 0})},
          {"views", each_view(blob_scene::view_of())},
          {"edges", per_view("frontal", edges)}};
}
Inputs inputs(double u_px, float direction = -1) { return inputs(upright_edges(200, 170, u_px, direction, 0, 170)); }

double value(const Inputs& inputs, double x, const Options& options = {{"pixel_step", std::int64_t(1)}}) {
  return cost_by(kNode, inputs, with({{"reach_px", 10.0}}, options))->value(at(x, 0));
}
double loss(double distance_px) { return std::sqrt(1 + distance_px * distance_px) - 1; }

TEST(DrrEdges, FindsTheRadiographsEdgesBetweenPixels) {
  for (const std::int64_t step : {1, 2, 3})
    for (const double x : {-4.0, -1.3, 0.0, 0.45, 2.0})
      EXPECT_NEAR(value(inputs(100.4), x, {{"pixel_step", step}}), loss(x - 0.4), 0.05) << step << " " << x;
}

TEST(DrrEdges, DistancesAreAcrossAnObliqueEdge) {
  EdgeMap map{200, 170, {}};
  const Vector2d normal(std::cos(radians(30)), std::sin(radians(30)));
  for (int v = 10; v < 160; ++v)
    map.pixels.push_back(
        {float(100 - (v - 80) * normal.y() / normal.x()), float(v), float(-normal.x()), float(-normal.y()), 1});
  const Inputs in = with(inputs(map), {{"projector", wall(
                                                         [](const auto&) {
                                                           return PixelGrid{70, 50, 1, 60, 60};
                                                         },
                                                         normal)}});
  for (const double x : {-4.0, 0.0, 2.0}) EXPECT_NEAR(value(in, x), loss(x * normal.x()), 0.05) << x;
}

TEST(DrrEdges, DistancesAlongAnEdgeBeginBeyondAPixel) {
  // A single edge pixel at (101, 80). The wall's points in rows 15 to 155 lie 1 px away across the edge, and up to 75
  // px along it.
  double expected = 0;
  for (int v = 15; v <= 155; ++v)
    expected += loss(std::min(10.0, std::hypot(1, std::max(0.0, std::abs(v - 80) - 1.5)))) / 141;
  EXPECT_NEAR(value(inputs(EdgeMap{200, 170, {{101, 80, -1, 0, 1}}}), 0), expected, 0.01);
}

TEST(DrrEdges, WhatDoesNotMatchIsTheWorst) {
  EXPECT_NEAR(value(inputs(130), 0), loss(10), 1e-9) << "beyond the reach";
  EXPECT_NEAR(value(inputs(100, 1), 0), loss(10), 1e-9) << "edges of the other direction";
  EXPECT_NEAR(value(inputs(100), 80), loss(10), 1e-9) << "out of view";
}

TEST(DrrEdges, BlurReachesBeyondTheRegion) {
  // A square. The region ends at the square, or further out.
  const auto value_with = [](int around_px, double blur_px) {
    const auto square = std::make_shared<const DrawnRadiograph>(
        PixelGrid{80.0 - around_px, 60.0 - around_px, 1, 40 + 2 * around_px, 40 + 2 * around_px},
        [](const Vector2d& p, const auto&) {
          return p.x() >= 80 && p.x() < 120 && p.y() >= 60 && p.y() < 100 ? 10 : 0;
        });
    return value(with(inputs(81), {{"projector", function<RadiographProjector>(square)}}), 0, {{"blur_px", blur_px}});
  };
  for (const double blur_px : {1.5, 4.0}) EXPECT_NEAR(value_with(0, blur_px), value_with(30, blur_px), 1e-3) << blur_px;
}

TEST(DrrEdges, AnotherFragmentsEdgesDoNotCount) {
  // Only the edges of the square's left border, which the wall meets too.
  const Inputs in = inputs(upright_edges(200, 170, 101, -1, 60, 90));
  EXPECT_LT(value(in, 1), loss(10) - 1);
  Inputs told = blob_scene::beside_another(in, blob_scene::square_outline(), blob_scene::square_outline());
  told["outline"] = told.at("projector");
  told["projector"] = in.at("projector");
  EXPECT_NEAR(value(told, 1), loss(10), 1e-9);
  told.erase("outline");
  EXPECT_EQ(refusal(kNode, told),
            "there are other fragments, but it is not known which of them is this one; wire 'outline', the one that "
            "draws this fragment");
}

TEST(DrrEdges, Levels) {
  const auto cost = cost_by(kNode, inputs(100)), coarse = cost->at_level({4, 20, 4});
  EXPECT_NEAR(coarse->value(at(80, 0)), loss(20), 1e-9);
  EXPECT_LT(coarse->value(at(0, 0)), 0.1);
  EXPECT_NEAR(coarse->value(at(12, 0)), loss(12), 0.5);
}

TEST(DrrEdges, SaysWhatIsEmpty) {
  const auto said = [](const Inputs& inputs, double x) {
    return cost_by(kNode, inputs, {{"reach_px", 10.0}})->nothing_compared(at(x, 0));
  };
  EXPECT_EQ(said(inputs(100), 5), "");
  EXPECT_EQ(said(inputs(130), 0), "view 'frontal': no edge lies within 10 px of the radiograph's edges");
  EXPECT_EQ(said(inputs(100), 80),
            "view 'frontal': it shows no edge of the radiograph, which is empty or outside the image");
  const View masked = blob_scene::with_mask(blob_scene::view_of(), nothing_shown(blob_scene::camera()));
  EXPECT_EQ(said(with(inputs(100), {{"views", each_view(masked)}}), 0),
            "view 'frontal': no edge of the radiograph lies inside image and mask");
}

}  // namespace marrow::test::drr_edges_test
