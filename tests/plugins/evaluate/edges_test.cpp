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

// How far edges lie from an outline, and what all of an outline or all frames have in common.
namespace marrow::test::outline_distance_test {

/// The vertical line u = 100 from v = 20 to 119, normal to the right, whatever the pose.
std::vector<OutlinePoint> line(const Camera& camera, const RigidTransform&, double) {
  std::vector<OutlinePoint> points;
  if (camera.width_px <= 100) return points;
  for (int v = 20; v < 120; ++v) points.push_back({100, float(v), 1, 0, Eigen::Vector3f(0, 0, 600)});
  return points;
}
DrawnOutline::Formula point(const OutlinePoint& point) {
  return [=](const Camera&, const RigidTransform&, double) { return std::vector{point}; };
}

/// Focal length 1000 px, so that 1 px is 0.6 mm at the outline's depth of 600 mm.
View view(const std::string& name = "frontal", int width_px = 200, int height_px = 150) {
  return even_view(name, pinhole(1000, width_px, height_px, {{100, 75}}));
}
EdgeMap edges_at(double u_px, float direction = 1, int from_v = 0, int to_v = 150) {
  return upright_edges(200, 150, u_px, direction, from_v, to_v, 10);
}

Inputs inputs(const Value& views, const Value& edges, const DrawnOutline::Formula& outline = line) {
  return {{"pose", item(Pose())},
          {"projector", function<OutlineProjector>(outline_of(outline))},
          {"views", views},
          {"edges", edges}};
}
Figures distances(const Inputs& inputs, const Options& options = {}) {
  return figures_of(call("evaluate.outline_distance", inputs, options).at("metrics"));
}
/// In one view.
Figures distances(const EdgeMap& edges, const Options& options = {}, const View& seen = view()) {
  return distances(inputs(each_view(seen), per_view("frontal", edges)), options);
}

TEST(OutlineDistance, OfAParallelLine) {
  const Figures found = distances(edges_at(102.5));
  expect_figures(found, {{"matched_percent", 100}}, 1e-9);
  expect_figures(found,
                 {{"median_px", 2.5},
                  {"p90_px", 2.5},
                  {"offset_px", 2.5},
                  {"spread_px", 0},
                  {"median_mm", 2.5 * 0.6},
                  {"frontal_median_px", 2.5}},
                 1e-6);
}

TEST(OutlineDistance, EdgesOfAnotherDirectionDoNotCount) {
  const EdgeMap edges = together(edges_at(109), edges_at(101, -1));
  expect_figures(distances(edges), {{"median_px", 9}}, 1e-6);
  expect_figures(distances(edges, {{"direction_tolerance_deg", 180.0}}), {{"median_px", 1}}, 1e-6);
}

TEST(OutlineDistance, UnmatchedPointsCountWithTheReach) {
  // Only the upper 60 of 100 outline points have edges beside them. The lower ones are farther away than the reach of 5
  // px, except 4 of them: v = 80 to 83 reach the last edge at v = 79, 3 px to the side.
  const Figures found = distances(edges_at(103, 1, 0, 80), {{"reach_px", 5.0}});
  expect_figures(found, {{"median_px", 3}, {"p90_px", 5}}, 1e-6);
  expect_figures(found, {{"matched_percent", 64}}, 1e-9);
}

TEST(OutlineDistance, ViewsTogetherAndEach) {
  const Value edges = per_view("frontal", edges_at(101), "lateral", edges_at(104));
  expect_figures(distances(inputs(each_view(view(), view("lateral")), edges)),
                 {{"frontal_median_px", 1}, {"lateral_median_px", 4}, {"median_px", 2.5}}, 1e-6);
}

TEST(OutlineDistance, MaskedPointsAreLeftOut) {
  View masked = view();
  masked.mask = mask_of(masked.camera, {0, 0, 200, 60});
  const Figures found = distances(edges_at(102, 1, 0, 60), {}, masked);
  expect_figures(found, {{"matched_percent", 100}}, 1e-9);
  expect_figures(found, {{"p90_px", 2}}, 1e-6);
}

TEST(OutlineDistance, FindsFarEdgesAcrossCells) {
  expect_figures(distances(edges_at(199), {{"reach_px", 500.0}}), {{"p90_px", 99}}, 1e-6);
  expect_figures(distances(edges_at(0), {{"reach_px", 500.0}}), {{"p90_px", 100}}, 1e-6);
}

TEST(OutlineDistance, TheNearestEdgeIsThatOfASearchThroughAll) {
  std::mt19937 random(3);
  const auto part = [&] { return double(random()) / 4294967296.0; };
  EdgeMap edges{203, 149, {}};
  for (int i = 0; i < 120; ++i) {
    const double angle = 6.28 * part();
    edges.pixels.push_back(
        {float(203 * part()), float(149 * part()), float(std::cos(angle)), float(std::sin(angle)), 1});
  }
  edges.pixels.push_back({-20, 30, 1, 0, 1});  // beyond the image, as a detector may say of its border
  edges.pixels.push_back({230, 170, 1, 0, 1});
  const Value views = each_view(view("frontal", 203, 149)), maps = per_view("frontal", edges);
  int none = 0;
  for (int i = 0; i < 3000; ++i) {
    const double u = 203 * part(), v = 149 * part(), angle = 6.28 * part(), reach_px = i % 3 == 0 ? 400 : 60 * part(),
                 angle_deg = i % 2 ? degrees(std::acos(0.9)) : 180, least_cosine = std::cos(radians(angle_deg));
    const OutlinePoint at{float(u), float(v), float(std::cos(angle)), float(std::sin(angle)),
                          Eigen::Vector3f(0, 0, 600)};
    double best = std::numeric_limits<double>::infinity();
    for (const auto& edge : edges.pixels)
      if (edge.direction_u * double(at.normal_u) + edge.direction_v * double(at.normal_v) >= least_cosine)
        best = std::min(best, std::hypot(double(edge.u_px) - at.u_px, double(edge.v_px) - at.v_px));
    Figures found =
        distances(inputs(views, maps, point(at)), {{"reach_px", reach_px}, {"direction_tolerance_deg", angle_deg}});
    ASSERT_EQ(found["matched_percent"], best <= reach_px ? 100 : 0) << best << " px, reach " << reach_px;
    EXPECT_EQ(found["median_px"], std::min(best, reach_px));
    none += best > reach_px;
  }
  EXPECT_GT(none, 100);
  EXPECT_LT(none, 2000);
}

TEST(OutlineDistance, SpreadAndPercentilesOfARoughLine) {
  // Edges lie 1, 2, ... 10 px outside in turn. So a point's own edge is the nearest only if its neighbours' edges are
  // as far.
  EdgeMap edges = edges_at(100, 1, 20, 120);
  for (auto& edge : edges.pixels) edge.u_px += 0.1f * float(int(edge.v_px) % 10);
  expect_figures(distances(edges),
                 {{"median_px", 0.45},
                  {"p90_px", 0.81},
                  {"median_mm", 0.45 * 0.6},
                  {"p90_mm", 0.81 * 0.6},
                  {"offset_px", 0.45},
                  {"spread_px", 0.25}},
                 1e-5);
  // The mask counts at the nearest pixel.
  View masked = view();
  masked.mask = mask_of(masked.camera, {100, 0, 1, 150});
  expect_figures(distances(edges, {}, masked), {{"frontal_median_px", 0.45}}, 1e-5);
}

/// Of the image of a view that does not show the outline.
EdgeMap narrow_edges() { return upright_edges(90, 150, 50, 1, 0, 150, 10); }

TEST(OutlineDistance, AViewWithoutOutlineIsLeftOutWithAWarning) {
  Heard heard;
  const auto metrics =
      call("evaluate.outline_distance",
           inputs(each_view(view(), view("narrow", 90)), per_view("frontal", edges_at(101), "narrow", narrow_edges())),
           {}, heard.context)
          .at("metrics");
  EXPECT_EQ(figures_of(metrics).size(), 14u);
  EXPECT_EQ(heard.warnings,
            Strings{"view 'narrow': no part of the outline is inside the image at this pose; the view is left out"});
}

TEST(OutlineDistance, SaysWhatIsWrong) {
  const auto message = [](const View& view, const Value& edges) {
    return refusal("evaluate.outline_distance", inputs(each_view(view), edges));
  };
  EXPECT_EQ(message(view(), per_view("lateral", edges_at(101))),
            "view 'frontal': there is no edge map of that name; make the edges from the same list of views");
  EXPECT_EQ(
      message(view(), per_view("frontal", EdgeMap{200, 150, {}})),
      "view 'frontal': the edge map is empty, so there is nothing to measure to; lower the edge detector's thresholds");
  EXPECT_EQ(message(view(), per_view("frontal", EdgeMap{100, 150, {{}}})),
            "view 'frontal': the edge map is for 100 x 150 pixels, the image has 200 x 150");
  EXPECT_EQ(message(view("frontal", 90), per_view("frontal", narrow_edges())),
            "the outline is outside the image in every view (1), so there is no distance; check the pose and that the "
            "cameras and the model use the same world frame");
}

constexpr double kRadius_px = 60, kMiddle_px = 150;

/// Points around the middle of the image, from one angle to another.
DrawnOutline::Formula arc(double to_deg) {
  return [=](const Camera&, const RigidTransform&, double) {
    std::vector<OutlinePoint> points;
    for (double deg = 0; deg < to_deg; deg += 2) {
      const double c = std::cos(radians(deg)), s = std::sin(radians(deg));
      points.push_back({float(kMiddle_px + kRadius_px * c), float(kMiddle_px + kRadius_px * s), float(c), float(s)});
    }
    return points;
  };
}

/// Edges on a circle. Those of the last eighth are 4 px farther out: another border.
Inputs of_circle(double radius_px, double u_px, double v_px, double side, double outline_deg = 360) {
  EdgeMap edges{300, 300, {}};
  for (double deg = 0; deg < 360; deg += 0.7) {
    const double c = std::cos(radians(deg)), s = std::sin(radians(deg)), r = radius_px + (deg > 315 ? 4 : 0);
    edges.pixels.push_back({float(u_px + r * c), float(v_px + r * s), float(side * c), float(side * s), 10});
  }
  return inputs(each_view(even_view("first", pinhole(1000, 300, 300, {{150, 150}}))), per_view("first", edges),
                arc(outline_deg));
}

TEST(OutlineOffset, IsFoundInSpiteOfAnotherBorder) {
  for (const double brighter_side : {1.0, -1.0}) {
    const auto metrics =
        call("evaluate.outline_offset", of_circle(61.2, 150.5, 149.3, brighter_side), {{"polarity", "either"}})
            .at("metrics");
    expect_figures(metrics, {{"first_across_px", 1.2}, {"first_shift_u_px", 0.5}, {"first_shift_v_px", -0.7}}, 0.1);
    EXPECT_LT(figure(metrics, "first_scatter_px"), 0.2);
  }
}

TEST(OutlineOffset, RefusesEdgesThatSayNothing) {
  EXPECT_EQ(refusal("evaluate.outline_offset", of_circle(61, 150, 150, -1)),
            "view 'first': only 0 points of the outline have an edge within 6 px, and 20 are needed; check the pose, "
            "or raise reach_px");
  EXPECT_EQ(refusal("evaluate.outline_offset", of_circle(61, 150, 150, 1, 50), {{"reach_px", 7.0}}),
            "view 'first': all of the outline runs in one direction, which does not tell an offset across it from a "
            "shift; leave this view out");
}

Inputs frames(const Numbers& x_mm, const Numbers& axial_deg) {
  List<Metrics> list;
  for (std::size_t i = 0; i < x_mm.size(); ++i)
    list.add(std::to_string(i + 1), Metrics{{{"x_mm", x_mm[i], "mm"}, {"axial_deg", axial_deg[i], "deg"}}});
  return {{"metrics", shipped::list(list, "frame")}};
}

// Mean 0.5; deviations -0.1, 0.1, -0.1, 0.1: variance 0.04 / 3.
TEST(CommonOffset, IsToldFromWhatDiffersBetweenFrames) {
  Heard heard;
  expect_figures(
      call("evaluate.common_offset", frames({0.4, 0.6, 0.4, 0.6}, {-2, 2, -1, 1}), {}, heard.context).at("metrics"),
      {{"frames", 4},
       {"common_x_mm", 0.5},
       {"rest_x_mm", std::sqrt(0.04 / 3)},
       {"error_x_mm", std::sqrt(0.04 / 3) / 2},
       {"common_axial_deg", 0}},
      1e-12);
  EXPECT_EQ(heard.warnings,
            Strings{"all 4 frames have in common: x_mm 0.5 mm, known to 0.058; without it they scatter by 0.12"});
}

TEST(CommonOffset, RefusesWhatTellsNothing) {
  const std::string node = "evaluate.common_offset";
  EXPECT_EQ(refusal(node, frames({1, 2}, {1, 2})),
            "there are 2 frames; it takes at least 3 to tell what they have in common");
  EXPECT_EQ(refusal(node, frames({1, 2, std::nan("")}, {1, 2, 3})),
            "frame '3': 'x_mm' is no finite number; leave this frame out");
  EXPECT_EQ(refusal(node, frames({1, 2, 3}, {1, 2, 3}), {{"figures", Strings{"y_mm"}}}),
            "frame '1' has no figure 'y_mm'; did you mean 'x_mm'?");
}

}  // namespace marrow::test::outline_distance_test
