// SPDX-License-Identifier: Apache-2.0
// The derivatives and the blocks of the contour's cost, compared with finite differences, with numbers worked out by
// hand, and with the effect of noise.
#include "tests/harness/node_test.hpp"

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
