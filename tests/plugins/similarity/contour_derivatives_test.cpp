// SPDX-License-Identifier: Apache-2.0
// The derivatives and the blocks of the contour's cost, compared with finite differences, with numbers worked out by
// hand, and with the effect of noise.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "marrow/domain/case.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/functions.hpp"
#include "shipped.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace contour_derivatives_test {

using marrow::Cost;
using marrow::FragmentFrame;
using marrow::List;
using marrow::Matrix6d;
using marrow::RigidTransform;
using marrow::Vector6d;

constexpr double kDepth_mm = 600, kFocal_px = 1000 / 0.586, kMiddle_px = 255.5;

/// Three sides of a rectangle: left and right at -40 and 40 mm, and the upper one at 50 mm. Each lies in a plane
/// through the source, so it is a straight line in the image at any depth. The view from the side shows another
/// rectangle.
class Sides : public marrow::OutlineProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera, const RigidTransform& pose,
                                            double spacing_px) const override {
    std::vector<marrow::OutlinePoint> points;
    const bool frontal = camera.camera_from_world.rotation(0, 0) > 0.5;
    const auto add = [&](double across_mm, double up_mm, double depth_mm, double normal_u, double normal_v) {
      const double scale = (kDepth_mm + depth_mm) / kDepth_mm;
      const Eigen::Vector3d seen(scale * across_mm, -scale * up_mm, kDepth_mm + depth_mm);
      const Eigen::Vector3d model = inverse(camera.camera_from_world) * seen;
      const Eigen::Vector2d pixel = marrow::project(camera, pose * model);
      points.push_back({float(pixel.x()), float(pixel.y()), float(normal_u), float(normal_v), model.cast<float>()});
    };
    for (double at = -35; at < 35; at += spacing_px * 0.35) {
      add(frontal ? -40 : -30, at, 20 * std::sin(0.1 * at), -1, 0);
      add(frontal ? 40 : 50, at, 15 * std::cos(0.07 * at), 1, 0);
      add(at, 50, -0.3 * at, 0, -1);
    }
    return points;
  }
};

/// Edges at this distance outside the sides.
marrow::EdgeMap edges_outside(double offset_px, bool frontal) {
  marrow::EdgeMap map{512, 512, {}};
  const auto px = [](double mm) { return kFocal_px * mm / kDepth_mm; };
  const float left = float(kMiddle_px + px(frontal ? -40 : -30) - offset_px),
              right = float(kMiddle_px + px(frontal ? 40 : 50) + offset_px),
              top = float(kMiddle_px - px(50) - offset_px);
  for (int u = 130; u < 380; ++u) map.pixels.push_back({float(u), top, 0, -1, 1});
  for (int v = 130; v < 400; ++v) {
    map.pixels.push_back({left, float(v), -1, 0, 1});
    map.pixels.push_back({right, float(v), 1, 0, 1});
  }
  return map;
}

/// A cost, and what it refers to.
struct Held {
  Held(const marrow::OutlineProjector* projector, const List<marrow::View>& views, const List<marrow::EdgeMap>& edges,
       const shipped::Options& options)
      : inputs{{"projector", marrow::Value::of<marrow::OutlineProjector>(
                                 std::shared_ptr<const marrow::OutlineProjector>(projector))},
               {"views", shipped::list(views, "view")},
               {"edges", shipped::list(edges, "view")}},
        made(shipped::call("similarity.contour_distance", inputs, options).at("cost")) {}
  const Cost& operator*() const { return made.as<Cost>(); }
  const Cost* operator->() const { return &made.as<Cost>(); }
  shipped::Inputs inputs;
  marrow::Value made;
};

/// `mask`: of the frontal view; may be empty.
Held cost_of(double offset_px, const shipped::Options& options, const cv::Mat& mask = {}) {
  List<marrow::View> views;
  List<marrow::EdgeMap> edges;
  for (const double angle : {0.0, 90.0}) {
    views.add(angle == 0 ? "frontal" : "lateral",
              marrow::View{"", {}, shapes::c_arm(angle), angle == 0 ? mask : cv::Mat()});
    edges.add(views.name(views.size() - 1), edges_outside(offset_px, angle == 0));
  }
  shipped::Options all{{"contour_spacing_px", 1.0}, {"reach_px", 20.0}, {"weights", std::vector<double>{3, 1}}};
  for (const auto& [name, value] : options) all[name] = value;
  return {new Sides, views, edges, all};
}

FragmentFrame frame() { return {Eigen::Vector3d(10, -5, 20), marrow::rotation_from_vector({0.2, -0.3, 0.4})}; }

/// Away from the minimum by about one or two pixels along all six axes.
RigidTransform away() {
  Vector6d motion;
  motion << 0.012, -0.015, 0.01, 0.7, -0.5, 0.6;
  return marrow::moved(RigidTransform{"world", "ct"}, frame(), motion);
}

/// A step that moves the outline by a small part of a pixel.
double step(int axis) { return axis < 3 ? 4e-4 : 0.02; }

Vector6d slope_by_differences(const Cost& cost, const RigidTransform& pose) {
  Vector6d slope;
  for (int axis = 0; axis < 6; ++axis) {
    const Vector6d motion = step(axis) * Vector6d::Unit(axis);
    slope[axis] =
        (cost.value(marrow::moved(pose, frame(), motion)) - cost.value(marrow::moved(pose, frame(), -motion))) /
        (2 * step(axis));
  }
  return slope;
}

Matrix6d curvature_by_differences(const Cost& cost, const RigidTransform& pose) {
  Matrix6d curvature;
  const auto value = [&](int i, double a, int j, double b) {
    return cost.value(marrow::moved(pose, frame(), a * step(i) * Vector6d::Unit(i) + b * step(j) * Vector6d::Unit(j)));
  };
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      curvature(i, j) =
          (value(i, 1, j, 1) - value(i, 1, j, -1) - value(i, -1, j, 1) + value(i, -1, j, -1)) / (4 * step(i) * step(j));
  return curvature;
}

/// A slope per step of each axis, so that all six numbers have the same unit.
Vector6d in_steps(Vector6d slope) {
  for (int axis = 0; axis < 6; ++axis) slope[axis] *= step(axis);
  return slope;
}

void expect_slope(const Cost& cost, double tolerance) {
  const auto about = cost.expansion(away(), frame());
  ASSERT_TRUE(about.has_value());
  EXPECT_NEAR(about->value, cost.value(away()), 1e-12);
  const Vector6d told = in_steps(about->gradient), found = in_steps(slope_by_differences(cost, away()));
  EXPECT_LT((told - found).norm(), tolerance * found.norm()) << told.transpose() << "\n" << found.transpose();
}

void expect_curvature_at_the_bottom(const Cost& cost) {
  const RigidTransform bottom{"world", "ct"};
  const auto about = cost.expansion(bottom, frame());
  ASSERT_TRUE(about.has_value());
  EXPECT_NEAR(about->value, 0, 1e-6);
  const Matrix6d found = curvature_by_differences(cost, bottom);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(about->curvature(i, j), found(i, j), 0.01 * std::sqrt(found(i, i) * found(j, j))) << i << ", " << j;
}

TEST(ContourDerivatives, TheSlopeIsThatOfTheValueWithAnEdgeOffset) {
  for (const double offset_px : {0.0, 1.5, -1.0})
    expect_slope(*cost_of(0, {{"estimate_offset", false}, {"edge_offset_px", offset_px}}), 0.005);
}

TEST(ContourDerivatives, TheSlopeIsThatOfTheValueWhereTheOffsetIsFound) { expect_slope(*cost_of(1.5, {}), 0.01); }

TEST(ContourDerivatives, TheSlopeIsThatOfTheValueBothWays) {
  expect_slope(*cost_of(0, {{"symmetric", true}, {"estimate_offset", false}, {"edge_offset_px", 1.0}}), 0.05);
}

TEST(ContourDerivatives, TheCurvatureIsThatOfTheValueAtTheBottom) {
  expect_curvature_at_the_bottom(*cost_of(1.5, {{"estimate_offset", false}, {"edge_offset_px", 1.5}}));
  expect_curvature_at_the_bottom(*cost_of(1.5, {}));
}

/// Leaves out one square of the frontal view, by a mask and as a block. Its side of 102 px is a fifth of the image.
void expect_same_without_a_block(double offset_px, const shipped::Options& options, const RigidTransform& pose,
                                 double tolerance) {
  constexpr int kSide_px = 102, kColumns = 6;
  const auto whole = cost_of(offset_px, options);
  const std::vector<Cost::Expansion> without = whole->expansion_without_each_block(pose, frame());
  ASSERT_EQ(without.size(), std::size_t(2 * kColumns * kColumns));
  for (const auto& [column, row] : {std::pair(1, 2), std::pair(3, 3), std::pair(2, 1)}) {
    cv::Mat mask(512, 512, CV_8U, cv::Scalar(255));
    mask(cv::Rect(column * kSide_px, row * kSide_px, kSide_px, kSide_px)) = 0;
    const auto expected = cost_of(offset_px, options, mask)->expansion(pose, frame());
    const Cost::Expansion& found = without[std::size_t(row * kColumns + column)];
    const Vector6d difference = in_steps(found.gradient - expected->gradient);
    const double change = in_steps(expected->gradient - whole->expansion(pose, frame())->gradient).norm();
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
  const RigidTransform bottom{"world", "ct"};
  for (const bool symmetric : {false, true}) {
    expect_same_without_a_block(0, {{"estimate_offset", false}, {"symmetric", symmetric}}, away(), 0.05);
    expect_same_without_a_block(1.5, {{"symmetric", symmetric}}, bottom, 0.05);
  }
}

/// An upright line at u = 100 + the pose's x in mm that faces left, from 50 px below the top of the image to 50 px
/// above its bottom.
class Line : public marrow::OutlineProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera, const RigidTransform& pose,
                                            double) const override {
    std::vector<marrow::OutlinePoint> points;
    for (int v = 50; v < camera.height_px - 50; ++v)
      points.push_back({float(100 + pose.translation_mm.x()), float(v), -1, 0});
    return points;
  }
};

marrow::EdgeMap line_at(double u_px, int height_px = 200) {
  marrow::EdgeMap map{200, height_px, {}};
  for (int v = 0; v < height_px; ++v) map.pixels.push_back({float(u_px), float(v), -1, 0, 1});
  return map;
}

RigidTransform shifted(double x_mm) {
  RigidTransform pose{"world", "ct"};
  pose.translation_mm.x() = x_mm;
  return pose;
}

/// The cost of views that all show the same line.
Held cost_of_line(const std::vector<marrow::EdgeMap>& maps, shipped::Options options) {
  List<marrow::View> views;
  List<marrow::EdgeMap> edges;
  for (const marrow::EdgeMap& map : maps) {
    marrow::Camera camera = shapes::c_arm(0, 200);
    camera.height_px = map.height_px;
    views.add("view " + std::to_string(views.size()), marrow::View{"", {}, camera, {}});
    edges.add(views.name(views.size() - 1), map);
  }
  options["contour_spacing_px"] = 1.0;
  options["estimate_offset"] = false;
  return {new Line, views, edges, options};
}

TEST(ContourBlocks, TheCurvatureWithoutThemIsThatOfTheLoss) {
  // The second derivative of sqrt(s^2 + x^2) with a scale s of 2 px is s^2 / (s^2 + x^2)^1.5, here at 1.5 px and at 0.
  const auto curvature = [](double edge_u_px) {
    const auto cost = cost_of_line({line_at(edge_u_px)}, {{"scale_px", 2.0}});
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
    marrow::EdgeMap map = line_at(100, 1850);  // 20 blocks
    double common = 0;
    for (std::size_t v = 0; v < map.pixels.size(); ++v) {
      if (v % 92 == 0) common = 0.5 * noise(random);
      map.pixels[v].u_px += float(common + noise(random));
    }
    const auto cost = cost_of_line({map}, {});
    const auto value = [&](double x) { return cost->value(shifted(x)); };
    const double h = 0.2;
    double x = 0;
    for (int round = 0; round < 4; ++round)
      x -= 0.5 * h * (value(x + h) - value(x - h)) / (value(x + h) - 2 * value(x) + value(x - h));
    const double curvature = (value(x + h) - 2 * value(x) + value(x - h)) / (h * h);
    const std::vector<double> after = cost->without_each_block(shifted(x + h)),
                              before = cost->without_each_block(shifted(x - h));
    double scatter = 0;
    for (std::size_t i = 0; i < after.size(); ++i) {
      const double slope = (after[i] - value(x + h) - before[i] + value(x - h)) / (2 * h);
      scatter += slope * slope;
    }
    squares += x * x / kRuns;
    predicted += scatter / (curvature * curvature) / kRuns;
  }
  std::printf("standard deviation %.4f px, predicted %.4f px\n", std::sqrt(squares), std::sqrt(predicted));
  EXPECT_LT(predicted, 1.4 * squares);
  EXPECT_GT(predicted, squares / 1.4);
}

}  // namespace contour_derivatives_test
