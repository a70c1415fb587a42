// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/evaluate/cone.hpp"

namespace marrow::test::shaft_width_test {

const std::string kNode = "evaluate.shaft_width";

struct Scene {
  List<ShaftLines> lines;
  List<View> views;
  void add(double angle_deg, const std::function<ShaftLines(const Camera&)>& borders) {
    const std::string name = angle_deg == 0    ? "frontal"
                             : angle_deg == 90 ? "lateral"
                                               : "at " + std::to_string(int(angle_deg));
    const View view = view_of(name, radiograph::camera(angle_deg));
    lines.add(name, borders(view.camera));
    views.add(name, view);
  }
  Inputs inputs() const { return {{"lines", list(lines, "view")}, {"views", list(views, "view")}}; }
  Value width(const Options& options = {}, const Context& context = {}) const {
    return call(kNode, inputs(), options, context).at("metrics");
  }
};

/// The exact borders of a cylinder, by default far from the isocentre, with the width that is measured there.
Scene scene_of(double radius_mm, const Numbers& angles_deg = {0, 90}, const Vector3d& point_mm = {30, 45, 0},
               const Vector3d& direction = {0.1, -0.05, 1}) {
  Scene scene;
  for (const double angle_deg : angles_deg)
    scene.add(angle_deg, [&](const Camera& camera) {
      ShaftLines lines = tube::borders(camera, point_mm, direction, radius_mm, 100, 400);
      lines.width_mm = (lines.left.from_px - lines.right.from_px).norm() * pixel_size_at_mm(camera, Vector3d::Zero());
      return lines;
    });
  return scene;
}

TEST(ShaftWidth, DeclaresADeviationForEachWidth) {
  EXPECT_TRUE(declares(kNode, same_length({"width_mm", "width_deviation_mm"})));
}

TEST(ShaftWidth, IsExactWhereTheMagnificationIsNot) {
  Heard heard;
  const auto metrics = scene_of(14).width({}, heard.context);
  expect_figures(metrics, {{"frontal_width_mm", 28}, {"lateral_width_mm", 28}}, 1e-6);
  for (const char* name : {"frontal_magnification", "lateral_magnification"})
    EXPECT_GT(std::abs(figure(metrics, name) - 1), 0.03);
  EXPECT_EQ(heard.warnings, Strings{});
}

TEST(ShaftWidth, IsThatOfAnyCylinderFromTwoAndThreeViews) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const Numbers& angles_deg : {Numbers{0, 90}, {-20, 35}, {0, 60, 120}})
    for (int i = 0; i < 100; ++i) {
      const double radius_mm = 12 + 4 * unit(random);
      const Vector3d point(40 * unit(random), 40 * unit(random), 0),
          direction(0.2 * unit(random), 0.2 * unit(random), 1);
      const Scene scene = scene_of(radius_mm, angles_deg, point, direction);
      const auto metrics = scene.width();
      for (const View& view : scene.views) expect_figures(metrics, {{view.name + "_width_mm", 2 * radius_mm}}, 1e-6);
    }
}

/// The point of a line that is nearest to a ray, by least squares over both lengths.
Vector3d nearest(const Vector3d& point, const Vector3d& direction, const Vector3d& source, const Vector3d& ray) {
  Eigen::Matrix<double, 3, 2> ways;
  ways << direction, -ray;
  return point + ways.colPivHouseholderQr().solve(source - point).eval().x() * direction;
}

TEST(ShaftWidth, OfAConeIsThatInTheMiddleOfEachPair) {
  for (const double half_angle_deg : {0.5, 2.0, 5.0}) {
    const Vector3d middle(20, -30, 5), direction = Vector3d(0.1, -0.05, 1).normalized();
    const double half_angle = radians(half_angle_deg);
    const cone::Cone known{middle - 14 / std::tan(half_angle) * direction, direction, half_angle};
    Scene scene;
    for (const double angle_deg : {0, 90})
      scene.add(angle_deg,
                [&](const Camera& camera) { return cone::borders(camera, known, angle_deg == 0 ? 60 : 240, 380); });
    const auto metrics = scene.width();
    for (const View& view : scene.views) {
      const ShaftLines& lines = *scene.lines.find(view.name);
      const Vector2d seen = 0.25 * (lines.left.from_px + lines.left.to_px + lines.right.from_px + lines.right.to_px);
      const Vector3d there =
          nearest(middle, direction, source_position_mm(view.camera), ray_direction(view.camera, seen));
      expect_figures(metrics, {{view.name + "_width_mm", 2 * known.radius_mm(there)}}, 1e-6);
    }
  }
}

TEST(ShaftWidth, WarnsWhereItIsNoShaft) {
  Heard heard;
  scene_of(40).width({}, heard.context);
  ASSERT_EQ(heard.warnings.size(), 2u);
  EXPECT_EQ(heard.warnings[0],
            "view 'frontal': the borders are 80 mm apart at the depth of the axis, but shafts are 15.0 to 55.0 mm "
            "wide; the views' pairs show different things");
}

Options bones(const Numbers& width_mm, const Numbers& deviation_mm) {
  return {{"width_mm", width_mm}, {"width_deviation_mm", deviation_mm}};
}

TEST(ShaftWidth, IsHeldAgainstOtherBonesWhereTheseAreGiven) {
  const Scene scene = scene_of(14);
  Heard heard;
  scene.width(bones({22, 27}, {1, 2}), heard.context);
  EXPECT_EQ(heard.warnings, Strings{});
  scene.width(bones({22, 37}, {1, 2}), heard.context);
  ASSERT_EQ(heard.warnings.size(), 2u);
  EXPECT_NE(heard.warnings[1].find("28 mm apart"), std::string::npos);
  EXPECT_NE(heard.warnings[1].find("19.0 to 43.0 mm wide"), std::string::npos);
}

TEST(ShaftWidth, IsRefusedFromViewsOfTheSameSideAndWidthsThatAreNone) {
  EXPECT_EQ(refusal(kNode, scene_of(14, {0, 4}).inputs()),
            "the 2 views see the shaft from nearly the same side: the planes of its axis meet at 3.7 degrees, but 10 "
            "are needed; use views farther apart");
  for (const Options& none : {bones({30, 0}, {3, 3}), bones({30, 30}, {3, -3})})
    EXPECT_EQ(refusal(kNode, scene_of(14).inputs(), none), "width_mm and width_deviation_mm must be positive");
}

TEST(ShaftWidth, SaysWhatItNeeds) {
  Heard heard;
  const Scene one = scene_of(14, {0});
  EXPECT_TRUE(one.width({}, heard.context).is_absent());
  EXPECT_EQ(heard.warnings,
            Strings{"only one view has shaft lines, so the distance of the bone from the source, and with it its "
                    "diameter, is not known"});
  EXPECT_EQ(refusal(kNode, Scene{scene_of(14).lines, one.views}.inputs()),
            "there are shaft lines of a view 'lateral', but no such view; wire the views that the lines were found in");
}

}  // namespace marrow::test::shaft_width_test
