// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/nearest_edges.hpp"
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

// The derivatives and the blocks of the contour's cost, compared with finite differences, with numbers worked out by
// hand, and with the effect of noise.
namespace marrow::test::contour_derivatives_test {

constexpr double kDepth_mm = 600, kFocal_px = 1000 / 0.586, kMiddle_px = 255.5;

/// Three sides of a rectangle: left and right at -40 and 40 mm, and the upper one at 50 mm. Each lies in a plane
/// through the source, so it is a straight line in the image at any depth. The view from the side shows another
/// rectangle.
std::vector<OutlinePoint> sides(const Camera& camera, const RigidTransform& pose, double spacing_px) {
  std::vector<OutlinePoint> points;
  const bool frontal = camera.camera_from_world.rotation(0, 0) > 0.5;
  const auto add = [&](double across_mm, double up_mm, double depth_mm, float normal_u, float normal_v) {
    const double scale = (kDepth_mm + depth_mm) / kDepth_mm;
    const Vector3d seen(scale * across_mm, -scale * up_mm, kDepth_mm + depth_mm);
    const Vector3d model = inverse(camera.camera_from_world) * seen;
    const Vector2d pixel = project(camera, pose * model);
    points.push_back({float(pixel.x()), float(pixel.y()), normal_u, normal_v, model.cast<float>()});
  };
  for (double at = -35; at < 35; at += spacing_px * 0.35) {
    add(frontal ? -40 : -30, at, 20 * std::sin(0.1 * at), -1, 0);
    add(frontal ? 40 : 50, at, 15 * std::cos(0.07 * at), 1, 0);
    add(at, 50, -0.3 * at, 0, -1);
  }
  return points;
}

/// Edges at this distance outside the sides.
EdgeMap edges_outside(double offset_px, bool frontal) {
  const auto px = [](double mm) { return kFocal_px * mm / kDepth_mm; };
  EdgeMap map{512, 512, {}};
  for (int u = 130; u < 380; ++u) map.pixels.push_back({float(u), float(kMiddle_px - px(50) - offset_px), 0, -1, 1});
  const double left_px = kMiddle_px + px(frontal ? -40 : -30) - offset_px,
               right_px = kMiddle_px + px(frontal ? 40 : 50) + offset_px;
  return together(
      map, together(upright_edges(512, 512, left_px, -1, 130, 400), upright_edges(512, 512, right_px, 1, 130, 400)));
}

/// `mask`: of the frontal view; may be empty.
std::shared_ptr<const Cost> cost_of(double offset_px, const Options& options, const cv::Mat& mask = {}) {
  return cost_by(
      "similarity.contour_distance",
      {{"projector", function<OutlineProjector>(outline_of(sides))},
       {"views", each_view(view_of("frontal", c_arm(0), {}, mask), view_of("lateral", c_arm(90)))},
       {"edges", per_view("frontal", edges_outside(offset_px, true), "lateral", edges_outside(offset_px, false))}},
      with({{"contour_spacing_px", 1.0}, {"reach_px", 20.0}, {"weights", Numbers{3, 1}}}, options));
}

const FragmentFrame kFrame{Vector3d(10, -5, 20), rotation_from_vector({0.2, -0.3, 0.4})};
const RigidTransform kBottom = placed({0, 0, 0});
/// Away from the minimum by about one or two pixels along all six axes.
const RigidTransform kAway = marrow::moved(kBottom, kFrame, Vector6d{0.012, -0.015, 0.01, 0.7, -0.5, 0.6});

/// A step that moves the outline by a small part of a pixel.
double step(int axis) { return axis < 3 ? 4e-4 : 0.02; }
/// A slope per step of each axis, so that all six numbers have the same unit.
Vector6d in_steps(Vector6d slope) {
  for (int axis = 0; axis < 6; ++axis) slope[axis] *= step(axis);
  return slope;
}
/// The value so many steps away along two axes.
double value_at(const Cost& cost, const RigidTransform& pose, int i, double a, int j = 0, double b = 0) {
  return cost.value(marrow::moved(pose, kFrame, a * step(i) * Vector6d::Unit(i) + b * step(j) * Vector6d::Unit(j)));
}

void expect_slope(double offset_px, const Options& options, double tolerance) {
  const auto cost = cost_of(offset_px, options);
  const auto about = cost->expansion(kAway, kFrame);
  ASSERT_TRUE(about.has_value());
  EXPECT_NEAR(about->value, cost->value(kAway), 1e-12);
  Vector6d found;
  for (int k = 0; k < 6; ++k) found[k] = (value_at(*cost, kAway, k, 1) - value_at(*cost, kAway, k, -1)) / 2;
  const Vector6d told = in_steps(about->gradient);
  EXPECT_LT((told - found).norm(), tolerance * found.norm()) << told.transpose() << "\n" << found.transpose();
}

TEST(ContourDerivatives, TheSlopeIsThatOfTheValueWithAnEdgeOffset) {
  for (const double offset_px : {0.0, 1.5, -1.0})
    expect_slope(0, {{"estimate_offset", false}, {"edge_offset_px", offset_px}}, 0.005);
}
TEST(ContourDerivatives, TheSlopeIsThatOfTheValueWhereTheOffsetIsFound) { expect_slope(1.5, {}, 0.01); }
TEST(ContourDerivatives, TheSlopeIsThatOfTheValueBothWays) {
  expect_slope(0, {{"symmetric", true}, {"estimate_offset", false}, {"edge_offset_px", 1.0}}, 0.05);
}

TEST(ContourDerivatives, TheCurvatureIsThatOfTheValueAtTheBottom) {
  for (const Options& options : {Options{{"estimate_offset", false}, {"edge_offset_px", 1.5}}, Options{}}) {
    const auto cost = cost_of(1.5, options);
    const auto about = cost->expansion(kBottom, kFrame);
    ASSERT_TRUE(about.has_value());
    EXPECT_NEAR(about->value, 0, 1e-6);
    Matrix6d found;
    const auto value = [&](int i, double a, int j, double b) { return value_at(*cost, kBottom, i, a, j, b); };
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        found(i, j) = (value(i, 1, j, 1) - value(i, 1, j, -1) - value(i, -1, j, 1) + value(i, -1, j, -1)) /
                      (4 * step(i) * step(j));
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        EXPECT_NEAR(about->curvature(i, j), found(i, j), 0.01 * std::sqrt(found(i, i) * found(j, j))) << i << ", " << j;
  }
}

/// Leaves out one square of the frontal view, by a mask and as a block. Its side of 102 px is a fifth of the image.
void expect_same_without_a_block(double offset_px, const Options& options, const RigidTransform& pose,
                                 double tolerance) {
  constexpr int kSide_px = 102, kColumns = 6;
  const auto whole = cost_of(offset_px, options);
  const std::vector<Cost::Expansion> without = whole->expansion_without_each_block(pose, kFrame);
  ASSERT_EQ(without.size(), std::size_t(2 * kColumns * kColumns));
  for (const auto& [column, row] : {std::pair(1, 2), std::pair(3, 3), std::pair(2, 1)}) {
    const cv::Mat mask = mask_of(c_arm(0), {column * kSide_px, row * kSide_px, kSide_px, kSide_px}, false);
    const auto expected = cost_of(offset_px, options, mask)->expansion(pose, kFrame);
    const Cost::Expansion& found = without[std::size_t(row * kColumns + column)];
    const Vector6d difference = in_steps(found.gradient - expected->gradient);
    const double change = in_steps(expected->gradient - whole->expansion(pose, kFrame)->gradient).norm();
    EXPECT_LE(difference.norm(), tolerance * change + 1e-9) << column << ", " << row;
    if (pose.translation_mm.norm() > 0) continue;  // away from the minimum, the curvatures differ
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const double scale = std::sqrt(expected->curvature(i, i) * expected->curvature(j, j));
        EXPECT_NEAR(found.curvature(i, j), expected->curvature(i, j), 0.02 * scale) << i << ", " << j;
      }
  }
}

TEST(ContourDerivatives, WithoutABlockAreThoseWithAMask) {
  for (const bool symmetric : {false, true}) {
    expect_same_without_a_block(0, {{"estimate_offset", false}, {"symmetric", symmetric}}, kAway, 0.05);
    expect_same_without_a_block(1.5, {{"symmetric", symmetric}}, kBottom, 0.05);
  }
}

/// An upright line at u = 100 + the pose's x in mm that faces left, from 50 px below the top of the image to 50 px
/// above its bottom.
std::vector<OutlinePoint> line(const Camera& camera, const RigidTransform& pose, double) {
  std::vector<OutlinePoint> points;
  for (int v = 50; v < camera.height_px - 50; ++v)
    points.push_back({float(100 + pose.translation_mm.x()), float(v), -1, 0});
  return points;
}
EdgeMap line_at(double u_px, int height_px = 200) { return upright_edges(200, height_px, u_px, -1, 0, height_px); }
RigidTransform shifted(double x_mm) { return placed({x_mm, 0, 0}); }

std::shared_ptr<const Cost> cost_of_line(const EdgeMap& map, const Options& options = {}) {
  Camera camera = c_arm(0, 200);
  camera.height_px = map.height_px;
  return cost_by("similarity.contour_distance",
                 {{"projector", function<OutlineProjector>(outline_of(line))},
                  {"views", each_view(view_of("only", camera))},
                  {"edges", per_view("only", map)}},
                 with({{"contour_spacing_px", 1.0}, {"estimate_offset", false}}, options));
}

TEST(ContourBlocks, TheCurvatureWithoutThemIsThatOfTheLoss) {
  // The second derivative of sqrt(s^2 + x^2) with a scale s of 2 px is s^2 / (s^2 + x^2)^1.5, here at 1.5 px and at 0.
  const auto curvature = [](double edge_u_px) {
    const auto cost = cost_of_line(line_at(edge_u_px), {{"scale_px", 2.0}});
    const auto without = cost->expansion_without_each_block(shifted(0), {});
    EXPECT_EQ(without.size(), 100u) << "one view has ten blocks along its image";
    return without.empty() ? 0 : without[0].curvature(3, 3);
  };
  EXPECT_NEAR(curvature(101.5) / curvature(100), 0.256 / 0.5, 1e-4);
}

TEST(ContourBlocks, PredictTheScatterThatNoiseMakes) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.4);
  constexpr int kRuns = 120;
  double squares = 0, predicted = 0;
  for (int run = 0; run < kRuns; ++run) {
    // Noise of each edge, and noise that all edges of a block have in common.
    EdgeMap map = line_at(100, 1850);  // 20 blocks
    double common = 0;
    for (std::size_t v = 0; v < map.pixels.size(); ++v) {
      if (v % 92 == 0) common = 0.5 * noise(random);
      map.pixels[v].u_px += float(common + noise(random));
    }
    const auto cost = cost_of_line(map);
    const auto value = [&](double x) { return cost->value(shifted(x)); };
    const double h = 0.2;
    double x = 0;
    for (int round = 0; round < 4; ++round)
      x -= 0.5 * h * (value(x + h) - value(x - h)) / (value(x + h) - 2 * value(x) + value(x - h));
    const double curvature = (value(x + h) - 2 * value(x) + value(x - h)) / (h * h);
    const Numbers after = cost->without_each_block(shifted(x + h)), before = cost->without_each_block(shifted(x - h));
    double scatter = 0;
    for (std::size_t i = 0; i < after.size(); ++i) {
      const double slope = (after[i] - value(x + h) - before[i] + value(x - h)) / (2 * h);
      scatter += slope * slope;
    }
    squares += x * x / kRuns;
    predicted += scatter / (curvature * curvature) / kRuns;
  }
  EXPECT_LT(predicted, 1.4 * squares);
  EXPECT_GT(predicted, squares / 1.4);
}

}  // namespace marrow::test::contour_derivatives_test
