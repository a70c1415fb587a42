// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "shipped.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/evaluate/cone.hpp"
#include "tests/plugins/evaluate/listener.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace shaft_width_test {

using listener::Listener;
using marrow::List, marrow::ShaftLines, marrow::View;
using shipped::figure;

marrow::View view_at(const std::string& name, double angle_deg) {
  marrow::View view;
  view.name = name;
  view.camera = radiograph::camera(angle_deg);
  return view;
}

struct Scene {
  List<ShaftLines> lines;
  List<View> views;
};

/// The exact borders of a cylinder far from the isocentre, with the width that is measured there.
Scene scene_of(double radius_mm, std::vector<double> angles = {0, 90}) {
  Scene scene;
  for (const double angle : angles) {
    const View view = view_at(angle == 0 ? "frontal" : "lateral", angle);
    ShaftLines lines = tube::borders(view.camera, {30, 45, 0}, {0.1, -0.05, 1}, radius_mm, 100, 400);
    lines.width_mm = (lines.left.from_px - lines.right.from_px).norm() *
                     marrow::pixel_size_at_mm(view.camera, Eigen::Vector3d::Zero());
    scene.lines.add(view.name, lines);
    scene.views.add(view.name, view);
  }
  return scene;
}

const std::string kNode = "evaluate.shaft_width";

shipped::Inputs inputs(const List<ShaftLines>& lines, const List<View>& views) {
  return {{"lines", shipped::list(lines, "view")}, {"views", shipped::list(views, "view")}};
}

marrow::Value width(const Scene& scene, const Listener& listener, const shipped::Options& options = {}) {
  return shipped::call(kNode, inputs(scene.lines, scene.views), options, listener.context).at("metrics");
}

TEST(ShaftWidth, DeclaresADeviationForEachWidth) {
  EXPECT_TRUE(shipped::declares(kNode, marrow::same_length({"width_mm", "width_deviation_mm"})));
}

TEST(ShaftWidth, IsExactWhereTheMagnificationIsNot) {
  const Scene scene = scene_of(14);
  Listener listener;
  const auto metrics = width(scene, listener);
  ASSERT_FALSE(metrics.is_absent());
  for (const std::string name : {"frontal", "lateral"}) {
    EXPECT_NEAR(figure(metrics, name + "_width_mm"), 28, 1e-6);
    std::printf("%s: magnified by %.3f\n", name.c_str(), figure(metrics, name + "_magnification"));
    EXPECT_GT(std::abs(figure(metrics, name + "_magnification") - 1), 0.03);
  }
  EXPECT_TRUE(listener.warnings.empty());
}

TEST(ShaftWidth, IsThatOfAnyCylinderFromTwoAndThreeViews) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const std::vector<double>& angles : {std::vector<double>{0, 90}, {-20, 35}, {0, 60, 120}})
    for (int i = 0; i < 100; ++i) {
      Scene scene;
      const double radius_mm = 12 + 4 * unit(random);
      const Eigen::Vector3d point(40 * unit(random), 40 * unit(random), 0),
          direction(0.2 * unit(random), 0.2 * unit(random), 1);
      for (const double angle : angles) {
        const View view = view_at("at " + std::to_string(int(angle)), angle);
        scene.lines.add(view.name, tube::borders(view.camera, point, direction, radius_mm, 100, 400));
        scene.views.add(view.name, view);
      }
      Listener listener;
      const auto metrics = width(scene, listener);
      ASSERT_FALSE(metrics.is_absent());
      for (const View& view : scene.views) EXPECT_NEAR(figure(metrics, view.name + "_width_mm"), 2 * radius_mm, 1e-6);
    }
}

/// The point of a line that is nearest to a ray, by least squares over both lengths.
Eigen::Vector3d nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& direction, const Eigen::Vector3d& source,
                        const Eigen::Vector3d& ray) {
  Eigen::Matrix<double, 3, 2> ways;
  ways << direction, -ray;
  const Eigen::Vector2d lengths = ways.colPivHouseholderQr().solve(source - point);
  return point + lengths.x() * direction;
}

TEST(ShaftWidth, OfAConeIsThatInTheMiddleOfEachPair) {
  for (const double half_angle_deg : {0.5, 2.0, 5.0}) {
    const Eigen::Vector3d middle(20, -30, 5), direction = Eigen::Vector3d(0.1, -0.05, 1).normalized();
    const double half_angle = marrow::radians(half_angle_deg);
    const cone::Cone known{middle - 14 / std::tan(half_angle) * direction, direction, half_angle};
    Scene scene;
    for (const double angle : {0, 90}) {
      const View view = view_at(angle == 0 ? "frontal" : "lateral", angle);
      scene.lines.add(view.name, cone::borders(view.camera, known, angle == 0 ? 60 : 240, 380));
      scene.views.add(view.name, view);
    }
    Listener listener;
    const auto metrics = width(scene, listener);
    ASSERT_FALSE(metrics.is_absent());
    for (const View& view : scene.views) {
      const ShaftLines& lines = *scene.lines.find(view.name);
      const Eigen::Vector2d seen =
          0.25 * (lines.left.from_px + lines.left.to_px + lines.right.from_px + lines.right.to_px);
      const Eigen::Vector3d there =
          nearest(middle, direction, marrow::source_position_mm(view.camera), marrow::ray_direction(view.camera, seen));
      EXPECT_NEAR(figure(metrics, view.name + "_width_mm"), 2 * known.radius_mm(there), 1e-6) << half_angle_deg;
    }
  }
}

TEST(ShaftWidth, WarnsWhereItIsNoShaft) {
  const Scene scene = scene_of(40);
  Listener listener;
  width(scene, listener);
  ASSERT_EQ(listener.warnings.size(), 2u);
  EXPECT_EQ(listener.warnings[0],
            "view 'frontal': the borders are 80 mm apart at the depth of the axis, but shafts are 15.0 to 55.0 mm "
            "wide; the views' pairs show different things");
}

TEST(ShaftWidth, IsHeldAgainstOtherBonesWhereTheseAreGiven) {
  const Scene scene = scene_of(14);
  using Numbers = std::vector<double>;
  shipped::Options tibia{{"width_mm", Numbers{22, 27}}, {"width_deviation_mm", Numbers{1, 2}}};
  Listener listener;
  width(scene, listener, tibia);
  EXPECT_TRUE(listener.warnings.empty());
  tibia["width_mm"] = Numbers{22, 37};
  width(scene, listener, tibia);
  ASSERT_EQ(listener.warnings.size(), 2u);
  EXPECT_NE(listener.warnings[1].find("28 mm apart"), std::string::npos);
  EXPECT_NE(listener.warnings[1].find("19.0 to 43.0 mm wide"), std::string::npos);
}

std::string refusal(const Scene& scene, const shipped::Options& options = {}) {
  return shipped::refusal(kNode, inputs(scene.lines, scene.views), options);
}
std::string refusal(const Scene& scene, const std::vector<double>& width_mm, const std::vector<double>& deviation_mm) {
  return refusal(scene, {{"width_mm", width_mm}, {"width_deviation_mm", deviation_mm}});
}

TEST(ShaftWidth, IsRefusedFromViewsOfTheSameSideAndWidthsThatAreNone) {
  EXPECT_EQ(refusal(scene_of(14, {0, 4})),
            "the 2 views see the shaft from nearly the same side: the planes of its axis meet at 3.7 degrees, but 10 "
            "are needed; use views farther apart");
  EXPECT_EQ(refusal(scene_of(14), {30, 0}, {3, 3}), "width_mm and width_deviation_mm must be positive");
  EXPECT_EQ(refusal(scene_of(14), {30, 30}, {3, -3}), "width_mm and width_deviation_mm must be positive");
}

TEST(ShaftWidth, SaysWhatItNeeds) {
  Listener listener;
  const Scene one = scene_of(14, {0});
  EXPECT_TRUE(width(one, listener).is_absent());
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_EQ(listener.warnings[0],
            "only one view has shaft lines, so the distance of the bone from the source, and with it its diameter, is "
            "not known");
  const Scene two = scene_of(14);
  EXPECT_EQ(refusal({two.lines, one.views}),
            "there are shaft lines of a view 'lateral', but no such view; wire the views that the lines were found in");
}

}  // namespace shaft_width_test
