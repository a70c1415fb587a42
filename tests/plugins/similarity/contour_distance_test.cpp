// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/nearest_outline.hpp"
#include "tests/plugins/similarity/blob_scene.hpp"

namespace marrow::test::contour_distance_test {

const Camera kCamera = c_arm(0, 200);

/// Upright edges at u, with a gradient towards `direction`.
EdgeMap line_at(double u_px, float direction = -1) { return upright_edges(200, 200, u_px, direction, 0, 200); }
RigidTransform shifted(double x_mm, double z_mm = 0) { return placed({x_mm, 0, z_mm}); }

Options fixed_offset(double offset_px = 0) {
  return {{"estimate_offset", false}, {"edge_offset_px", offset_px}, {"contour_spacing_px", 1.0}, {"reach_px", 10.0}};
}

/// One fragment alone, whose outline is the line u = 100 + x from v = 50 to 149.
Inputs inputs(const EdgeMap& edges, const cv::Mat& mask = {}) {
  return {{"projector", function<OutlineProjector>(blob_scene::upright_line(100, 50, 150))},
          {"views", each_view(view_of("lateral", kCamera, {}, mask))},
          {"edges", per_view("lateral", edges)}};
}
std::shared_ptr<const Cost> contour_distance(const Inputs& inputs, const Options& options = fixed_offset()) {
  return cost_by("similarity.contour_distance", inputs, options);
}
std::shared_ptr<const Cost> contour_distance(const EdgeMap& edges, const Options& options = fixed_offset()) {
  return contour_distance(inputs(edges), options);
}

/// The loss of a distance in px.
double loss(double distance_px) { return std::sqrt(1 + distance_px * distance_px) - 1; }

TEST(ContourDistance, IsTheDistanceThatOneComputesByHand) {
  const auto cost = contour_distance(line_at(100.25));
  for (const double x : {-7.0, -2.0, 0.25, 1.0, 4.0}) EXPECT_NEAR(cost->value(shifted(x)), loss(x - 0.25), 1e-5) << x;
  EXPECT_NEAR(cost->value(shifted(30)), loss(10), 1e-5) << "beyond the reach";
  EXPECT_EQ(cost->value(shifted(std::nan(""))), cost->value(shifted(500))) << "a pose that is not a number";
}

TEST(ContourDistance, OfEitherPolarityTheNearerEdgeCounts) {
  // Darker outside at 103, brighter outside at 98.
  EdgeMap map = together(line_at(103, 1), line_at(98));
  std::sort(map.pixels.begin(), map.pixels.end(),
            [](const auto& a, const auto& b) { return a.v_px != b.v_px ? a.v_px < b.v_px : a.u_px < b.u_px; });
  for (const bool symmetric : {false, true}) {
    const Options options = with(fixed_offset(), {{"symmetric", symmetric}});
    const auto one = contour_distance(map, options),
               both = contour_distance(map, with(options, {{"polarity", std::string("either")}}));
    EXPECT_GT(one->value(shifted(3)), one->value(shifted(2)));
    EXPECT_NEAR(both->value(shifted(3)), 0, symmetric ? 0.3 : 1e-5);
    EXPECT_NEAR(both->value(shifted(-2)), 0, symmetric ? 0.3 : 1e-5);
    if (symmetric) continue;
    EXPECT_NEAR(both->value(shifted(2)), loss(1), 1e-5);
    EXPECT_NEAR(one->value(shifted(2)), loss(4), 1e-5);
  }
}

TEST(ContourDistance, InAPhotographBlurMovesEdgesToNoSide) {
  // A step blurred by 2 px. In an X-ray image, such an edge is expected 1.5 px inside the outline.
  const cv::Mat blurred =
      image_of<float>(200, 200, [](int u, int) { return 70 + 30 * std::erf((99.5 - u) / (2 * std::sqrt(2.0))); });
  const Inputs in = with(inputs(line_at(99.5)), {{"views", each_view(view_of("lateral", kCamera, blurred))}});
  // The search for the offset ends 3 px from the expected one. An edge 4 px inside is reached with x_ray only.
  const auto value = [&](bool x_ray) {
    return contour_distance(in, {{"x_ray", x_ray}, {"contour_spacing_px", 1.0}, {"reach_px", 10.0}})
        ->value(shifted(99.5 - 100 - 4));
  };
  EXPECT_LT(value(true), 0.01);
  EXPECT_NEAR(value(false), loss(1), 0.01);
}

TEST(ContourDistance, EdgesOfTheOtherDirectionDoNotCount) {
  EXPECT_NEAR(contour_distance(together(line_at(100), line_at(103, 1)))->value(shifted(3)), loss(3), 1e-5);
}

TEST(ContourDistance, PointsOfADirectionThatNoEdgeHasPayTheMost) {
  // The same line, but every second point faces right.
  const auto line = blob_scene::upright_line(100, 50, 150);
  const auto two_sided = outline_of([=](const Camera& camera, const RigidTransform& pose, double spacing_px) {
    std::vector<OutlinePoint> points = line->outline(camera, pose, spacing_px);
    for (std::size_t i = 0; i < points.size(); i += 2) points[i].normal_u = 1;
    return points;
  });
  const Inputs in = with(inputs(line_at(100)), {{"projector", function<OutlineProjector>(two_sided)}});
  EXPECT_NEAR(contour_distance(in)->value(shifted(2)), 0.5 * loss(2) + 0.5 * loss(10), 1e-5);
}

TEST(ContourDistance, OffsetIsGivenOrFound) {
  // The edges lie 2 px to the right of u = 100. The outline faces left, so this is 2 px inside.
  EXPECT_NEAR(contour_distance(line_at(102), fixed_offset(-2))->value(shifted(0)), 0, 1e-5);
  EXPECT_NEAR(contour_distance(line_at(102), fixed_offset(2))->value(shifted(0)), loss(4), 1e-5);
  const auto found = contour_distance(line_at(102), with(fixed_offset(), {{"estimate_offset", true}}));
  EXPECT_NEAR(found->value(shifted(0)), 0, 1e-5);
  EXPECT_NEAR(found->value(shifted(-3)), loss(2), 1e-5) << "the offset explains at most 3 px";
}

TEST(ContourDistance, PointsOutsideImageAndMaskDoNotPay) {
  EdgeMap map = line_at(100);
  for (auto& edge : map.pixels)
    if (edge.v_px > 95) edge.u_px = 150;
  const auto all = contour_distance(map);
  EXPECT_GT(all->value(shifted(0)), 2);
  const Options options = with(fixed_offset(), {{"contour_spacing_px", 0.5}});  // 69 points of the upper part remain
  EXPECT_NEAR(contour_distance(inputs(map, mask_of(kCamera, {0, 0, 200, 85})), options)->value(shifted(0)),
              51.0 / 120 * all->value(shifted(100)), 1e-5)
      << "60 px of outline are the least that is evidence";
  EXPECT_NEAR(all->value(shifted(0, 500)), loss(10), 1e-5) << "nothing to compare is the worst";
}

TEST(ContourDistance, LevelsHaveTheirOwnReach) {
  EXPECT_NEAR(contour_distance(line_at(100))->at_level({5, 4})->value(shifted(30)), loss(4), 1e-5);
}

TEST(ContourDistance, WithoutEachBlockIsTheMeanOverTheOthers) {
  // The 100 points lie in the fifth column of blocks of 25 px, 25 in each of four rows. In the first two rows they are
  // 2 px away from the edges, in the others 1 px.
  EdgeMap map = line_at(101);
  for (auto& edge : map.pixels)
    if (edge.v_px < 100) edge.u_px = 102;
  const auto cost = contour_distance(map);
  const double near = loss(1), far = loss(2);
  EXPECT_NEAR(cost->value(shifted(0)), (near + far) / 2, 2e-2) << "a point beside the step may be nearer to the other";
  const Numbers without = cost->without_each_block(shifted(0));
  ASSERT_EQ(without.size(), 8u * 8);
  for (std::size_t i = 0; i < without.size(); ++i) {
    const double expected = i == 20 || i == 28   ? (2 * near + far) / 3
                            : i == 36 || i == 44 ? (near + 2 * far) / 3
                                                 : (near + far) / 2;
    EXPECT_NEAR(without[i], expected, 2e-2) << i;
  }
}

TEST(ContourDistance, SaysWhatIsWrong) {
  const auto message = [](const Inputs& in) { return refusal("similarity.contour_distance", in); };
  EXPECT_EQ(message(inputs({200, 200, {}})),
            "view 'lateral': the edge map is empty, so nothing can be compared; lower the thresholds of the edge "
            "detector, or check that the image shows the bone");
  EdgeMap small = line_at(50, 1);
  small.width_px = 100;
  EXPECT_EQ(message(inputs(small)),
            "view 'lateral': the edge map has 100 x 200 pixels, but the camera 200 x 200; give the edges of this "
            "view's own image");
  EXPECT_EQ(message(with(inputs(small), {{"edges", list(List<EdgeMap>(), "view")}})),
            "there are 1 views, but edge maps of 0; give the edges of each view");
  EXPECT_EQ(message(inputs(line_at(50, 1), nothing_shown(kCamera))),
            "view 'lateral': no edge lies inside the mask; widen the mask");
}

TEST(ContourDistance, SaysWhatIsEmpty) {
  const auto said = [](const Inputs& in, double x, double z = 0) {
    return contour_distance(in)->nothing_compared(shifted(x, z));
  };
  const Inputs in = inputs(line_at(100));
  EXPECT_EQ(said(in, 9), "") << "within the reach of 10 px";
  EXPECT_EQ(said(in, 30), "view 'lateral': no edge lies within 10 px of the model's outline");
  EXPECT_EQ(said(inputs(line_at(100, 1)), 0), "view 'lateral': no edge lies within 10 px of the model's outline")
      << "none of the outline's direction";
  EXPECT_EQ(said(in, 0, 500),
            "view 'lateral': it shows nothing of the model's outline, which is empty or outside the image");
  EXPECT_EQ(said(inputs(line_at(10), mask_of(kCamera, {0, 0, 20, 200})), 0),
            "view 'lateral': the mask hides the whole outline of the model");
}

TEST(NearestOutline, IsThatOfASearchThroughAll) {
  std::vector<OutlinePoint> points;
  for (int i = 0; i < 300; ++i)
    points.push_back({float((i * 37) % 131) - 5, float((i * 53) % 101) - 5, float(std::cos(0.7 * i)),
                      float(std::sin(0.7 * i)), Eigen::Vector3f::Zero()});
  for (const double reach_px : {0.5, 4.0, 9.0}) {
    const match::NearestOutline nearest(points, 120, 90, reach_px);
    int within = 0;
    for (float v = -2; v < 94; v += 1.7f)
      for (float u = -2; u < 124; u += 1.9f) {
        const auto away = [&](const OutlinePoint& point) {
          return std::hypot(double(point.u_px) - u, double(point.v_px) - v);
        };
        double best = reach_px;
        bool is_any = false;
        for (const OutlinePoint& point : points)
          if (away(point) < best - 1e-6 && 0.6 * double(point.normal_u) + 0.8 * double(point.normal_v) >= 0.5)
            best = away(point), is_any = true;
        const int found = nearest.find(EdgePixel{u, v, 0.6f, 0.8f, 1}, reach_px, 0.5f);
        ASSERT_EQ(found >= 0, is_any) << u << " " << v << " " << reach_px;
        if (found < 0) continue;
        ++within;
        EXPECT_NEAR(away(points[std::size_t(found)]), best, 1e-4);
      }
    EXPECT_GT(within, 5);
  }
}

}  // namespace marrow::test::contour_distance_test
