// SPDX-License-Identifier: Apache-2.0
// The edges that a body truly has, and how found ones compare with them.
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::edges_figures_test {

EdgeMap line(double u_px, int from_v, int to_v) { return upright_edges(100, 80, u_px, 1, from_v, to_v); }

Inputs compared(const EdgeMap& found, const EdgeMap& truth) { return {{"edges", item(found)}, {"truth", item(truth)}}; }
Figures figures(const EdgeMap& found, const EdgeMap& truth, const Options& options = {}) {
  return figures_of(call("evaluate.edges", compared(found, truth), options).at("metrics"));
}

TEST(EdgeFigures, AreThoseCountedByHand) {
  // 40 edges lie 0.4 px beside the border, 10 stand 20 px away from it, and 20 of its 60 pixels have none near.
  const EdgeMap found = together(line(30.4, 10, 50), line(50, 10, 20)), truth = line(30, 10, 70);
  const Figures of_all = figures(found, truth);
  EXPECT_EQ(of_all.at("edges"), 50);
  // The last edge is near to pixels up to 2.97 px further on.
  expect_figures(of_all, {{"false_alarms", 0.2}, {"missed", 18.0 / 60}}, 1e-12);
  expect_figures(of_all, {{"offset_px", 0.4}}, 1e-5);
  expect_figures(figures(found, truth, {{"within_px", 0.5}}), {{"missed", 20.0 / 60}}, 1e-12);
  EXPECT_EQ(figures(found, truth, {{"within_px", 20.0}}).at("false_alarms"), 0);
}

TEST(EdgeFigures, TheOffsetIsAcrossTheBorder) {
  // Border points 5 px apart: along it, an edge lies up to 2.5 px beside the nearest.
  EdgeMap sparse = line(30, 10, 71);
  std::erase_if(sparse.pixels, [](const EdgePixel& edge) { return int(edge.v_px) % 5 != 0; });
  EXPECT_NEAR(figures(line(31, 10, 70), sparse).at("offset_px"), 1, 1e-12);
}

TEST(EdgeFigures, WithoutEdgesEverythingIsMissed) {
  const Figures none = figures(line(30, 0, 0), line(30, 10, 70));
  EXPECT_EQ(none.at("edges"), 0);
  EXPECT_EQ(none.at("missed"), 1);
  EXPECT_TRUE(std::isnan(none.at("false_alarms")));
  EXPECT_TRUE(std::isnan(none.at("offset_px")));
}

TEST(EdgeFigures, OfDifferentImagesOrWithoutBordersAreRefused) {
  EdgeMap other = line(30, 10, 70);
  other.width_px = 101;
  EXPECT_EQ(refusal("evaluate.edges", compared(other, line(30, 10, 70))),
            "the edges are of an image of 101 x 80 pixels, but the true borders of one of 100 x 80; compare edges of "
            "the same view");
  EXPECT_EQ(refusal("evaluate.edges", compared(other, {101, 80, {}})),
            "the image shows no true border, so there is nothing to compare");
}

using Fragments = std::vector<std::pair<std::string, double>>;

/// True edges of balls of 20 mm radius at these x, in pixels of 0.6 mm in the world's origin.
Inputs balls(const Fragments& fragments, const Strings& drawn) {
  List<Truth> truths;
  for (const auto& [name, x_mm] : fragments) truths.add(name, Truth{placed({x_mm, 0, 0})});
  List<OutlineProjector> outlines;
  for (const std::string& name : drawn)
    outlines.add_shared(name,
                        std::make_shared<const analytic::BodyProjector>(analytic::Body{{{0, 0, 0}, {20, 20, 20}}}));
  return {{"camera", item(analytic::c_arm(0, 200, 200, 1))},
          {"truths", shipped::list(truths, "fragment")},
          {"projectors", shipped::list(outlines, "fragment")}};
}
EdgeMap edges_of(const Fragments& fragments, const Strings& drawn) {
  return output<EdgeMap>("evaluate.true_edges", "edges", balls(fragments, drawn));
}

TEST(TrueEdges, LieOnTheCircleThatABallThrows) {
  const EdgeMap edges = edges_of({{"ball", 0}}, {"ball"});
  EXPECT_EQ(edges.width_px, 200);
  ASSERT_GT(edges.pixels.size(), 150u);
  // The circle of the cone that touches the ball, seen from 600 mm, with a focal length of 1000 px.
  const double radius_px = 1000 * 20 / std::sqrt(600.0 * 600 - 20 * 20);
  for (const EdgePixel& edge : edges.pixels) {
    const Vector2d from(edge.u_px - 99.5, edge.v_px - 99.5);
    EXPECT_NEAR(from.norm(), radius_px, 0.02);
    EXPECT_NEAR(from.normalized().dot(Vector2d(edge.direction_u, edge.direction_v)), 1, 1e-3);
    EXPECT_EQ(edge.magnitude, 1);
  }
}

TEST(TrueEdges, AreOneForEachPixelInTheOrderOfPixelsAlsoWhereFragmentsOverlap) {
  const EdgeMap one = edges_of({{"a", 0}}, {"a"}), both = edges_of({{"a", 0}, {"b", 10}}, {"a", "b"});
  EXPECT_EQ(edges_of({{"a", 0}, {"b", 0}}, {"b", "a"}).pixels.size(), one.pixels.size());
  EXPECT_GT(both.pixels.size(), 3 * one.pixels.size() / 2);  // the part inside of the other ball, too
  long before = -1;
  for (const EdgePixel& edge : both.pixels) {
    const long pixel = std::lround(edge.v_px) * 200 + std::lround(edge.u_px);
    EXPECT_GT(pixel, before);
    before = pixel;
  }
}

TEST(TrueEdges, SayWhichOutlineIsMissing) {
  const std::string message = refusal("evaluate.true_edges", balls({{"distal", 0}}, {"proximal"}));
  EXPECT_NE(message.find("there is no outline of fragment 'distal'; make outlines from the models"), std::string::npos)
      << message;
}

}  // namespace marrow::test::edges_figures_test
