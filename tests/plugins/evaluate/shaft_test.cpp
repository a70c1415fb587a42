// SPDX-License-Identifier: Apache-2.0
#include "plugins/evaluate/true_borders.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace marrow::test::cone {

// Where a circular cone of known axis is seen, by the planes through the source that touch it.

/// The cone {X : the angle at `apex_mm` between X and the unit vector `direction` is `half_angle_rad`}.
struct Cone {
  Vector3d apex_mm, direction;
  double half_angle_rad;
  /// Diameter of the section across the axis through a point.
  double radius_mm(const Vector3d& point) const { return std::tan(half_angle_rad) * direction.dot(point - apex_mm); }
};

/// Exact borders between two heights of the image. A plane that touches the cone goes through its apex, and its unit
/// normal has the cosine -sin(half angle) with the axis.
inline ShaftLines borders(const Camera& camera, const Cone& cone, double from_v, double to_v) {
  const Vector3d to_apex = (cone.apex_mm - source_position_mm(camera)).normalized(),
                 along = (cone.direction - to_apex * to_apex.dot(cone.direction)).normalized(),
                 across = to_apex.cross(along);
  const double part = -std::sin(cone.half_angle_rad) / along.dot(cone.direction), rest = std::sqrt(1 - part * part);
  LineSegment segments[2];
  for (const int side : {0, 1}) {
    const Vector3d normal = part * along + (side ? -rest : rest) * across;
    const Vector3d line = camera.intrinsics.inverse().transpose() * (camera.camera_from_world.rotation * normal);
    segments[side] = {tube::at_height(line, from_v), tube::at_height(line, to_v)};
  }
  ShaftLines lines;
  const bool first_is_left = segments[0].from_px.x() > segments[1].from_px.x();  // they run down
  lines.left = segments[first_is_left ? 0 : 1], lines.right = segments[first_is_left ? 1 : 0];
  return lines;
}

}  // namespace marrow::test::cone

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
  EXPECT_EQ(heard.warnings, Strings{"only one view has shaft lines, so the distance of the bone from the source, and "
                                    "with it its diameter, is not known"});
  EXPECT_EQ(refusal(kNode, Scene{scene_of(14).lines, one.views}.inputs()),
            "there are shaft lines of a view 'lateral', but no such view; wire the views that the lines were found in");
}

}  // namespace marrow::test::shaft_width_test

namespace marrow::test::shaft_lines_test {

constexpr double kRadius_mm = 14, kPixel_mm = 0.6 * 300 / 512;  // at the isocentre

const View kFrontal = view_of("frontal", radiograph::camera(0));

ShaftLines borders(double radius_mm = kRadius_mm) {
  return tube::borders(kFrontal.camera, {0, 0, 0}, Vector3d::UnitZ(), radius_mm, 100, 400);
}
/// A cylinder along the world's z axis, shifted in the image.
Truth shifted(double x_mm) { return {{"world", "model", Matrix3d::Identity(), {x_mm, 0, 0}}}; }

Value compared(const ShaftLines& lines, const List<Truth>& truths, const Context& context = {}) {
  List<Mesh> models;
  if (!truths.empty())
    for (const std::string name : {"distal", "far", "near", "unknown"})
      models.add(name, tube::cylinder(kRadius_mm, 200));
  return call("evaluate.shaft_lines",
              {{"lines", item(lines)},
               {"view", item(kFrontal)},
               {"models", list(models, "fragment")},
               {"truths", list(truths, "fragment")}},
              {}, context)
      .at("metrics");
}
Figures errors(const ShaftLines& lines) { return figures_of(compared(lines, named("distal", shifted(0)))); }

TEST(EvaluateShaftLines, ExactBordersHaveNoError) {
  const Figures found = errors(borders());
  expect_figures(found, {{"border_angle_deg", 0}, {"border_offset_mm", 0}, {"axis_offset_mm", 0}}, 0.01);
  expect_figures(found, {{"worst_mm", 0}, {"width_error_mm", 0}}, 0.02);
}

TEST(EvaluateShaftLines, NarrowerOnesLieInside) {
  const Figures found = errors(borders(kRadius_mm - 0.5));
  expect_figures(found, {{"border_offset_mm", 0.5}}, 0.02);
  expect_figures(found, {{"width_error_mm", -1}}, 0.04);
  expect_figures(found, {{"axis_offset_mm", 0}}, 0.01);
}

TEST(EvaluateShaftLines, APairThatIsOnePercentTooWideSaysSo) {
  const Figures found = errors(borders(1.01 * kRadius_mm));
  expect_figures(found, {{"width_error_mm", 0.28}}, 0.01);
  expect_figures(found, {{"true_width_mm", 28}}, 0.02);
}

/// Turned about its middle, and shifted.
LineSegment moved(const LineSegment& border, double turn_deg, const Vector2d& shift_px = {0, 0}) {
  const Vector2d middle = 0.5 * (border.from_px + border.to_px) + shift_px,
                 half = Eigen::Rotation2Dd(radians(turn_deg)) * (0.5 * (border.to_px - border.from_px));
  return {middle - half, middle + half};
}

TEST(EvaluateShaftLines, OneThatIsTurnedSaysByHowMuch) {
  ShaftLines lines = borders();
  lines.left = moved(lines.left, 1);
  const Figures found = errors(lines);
  expect_figures(found, {{"border_angle_deg", 1}, {"axis_angle_deg", 0.5}}, 0.02);
  expect_figures(found, {{"worst_mm", 150 * std::sin(radians(1)) * kPixel_mm}}, 0.05);
}

TEST(EvaluateShaftLines, LengthsAndWidths) {
  ShaftLines lines = borders();
  lines.log_likelihood = -3.5;
  const Figures found = errors(lines);
  // The outline is 0.3 mm before the axis, which is at 600 mm.
  expect_figures(found, {{"length_mm", kPixel_mm * (lines.left.to_px - lines.left.from_px).norm()}}, 0.05);
  expect_figures(found, {{"true_width_mm", kPixel_mm * (lines.left.from_px - lines.right.from_px).norm()}}, 0.02);
  EXPECT_EQ(found.at("log_likelihood"), -3.5);
}

TEST(EvaluateShaftLines, TheWorseOfTheTwoBordersCounts) {
  // One of them 0.9 mm outwards and turned by half a degree.
  for (const bool left : {true, false}) {
    ShaftLines lines = borders();
    const Vector2d outwards = (left ? 1 : -1) * (lines.left.from_px - lines.right.from_px).normalized();
    LineSegment& border = left ? lines.left : lines.right;
    border = moved(border, -0.5, 0.9 / kPixel_mm * outwards);
    const Figures found = errors(lines);
    expect_figures(
        found,
        {{"border_offset_mm", 0.9}, {"border_angle_deg", 0.5}, {"axis_offset_mm", 0.45}, {"axis_angle_deg", 0.25}},
        0.02);
    expect_figures(found, {{"width_error_mm", 0.9}}, 0.04);
    expect_figures(found, {{"worst_mm", 0.9 + 150 * std::sin(radians(0.5)) * kPixel_mm}}, 0.05);
  }
}

TEST(EvaluateShaftLines, AgainstTheFragmentWhoseOutlineIsNearest) {
  const auto metrics = compared(borders(), named("distal", shifted(-2), "far", shifted(4), "near", shifted(0.3)));
  ASSERT_FALSE(metrics.is_absent());
  const Metric& second = metrics.as<Metrics>().items[1];
  EXPECT_NEAR(second.value, 0.3, 0.02) << second.name;
}

TEST(EvaluateShaftLines, WithoutABoneThereTheyCannotBeCompared) {
  Heard heard;
  EXPECT_TRUE(compared(borders(), {}, heard.context).is_absent());
  EXPECT_EQ(heard.warnings, Strings{"view 'frontal': no fragment of known pose lies where the pair of borders was "
                                    "found, so there is nothing to compare it with"});
}

}  // namespace marrow::test::shaft_lines_test

// Cylinders, cones and boxes, whose borders are known exactly. An error of 1 % of the width would be 0.28 mm.
namespace marrow::test::true_borders_test {

using tube::posed;

constexpr double kRadius_mm = 14, kPixel_mm = 0.6 * 300 / 512;  // at the isocentre
constexpr double kLimit_mm = 0.01;

Mesh cylinder(double half_mm = 150) {
  return tube::mesh(
      half_mm, [](double, double) { return kRadius_mm; }, [](double) { return Vector3d(0, 0, 0); }, 360, 60);
}

/// The farthest that an end of one segment is from the line through the other, in mm at the isocentre.
double apart_mm(const LineSegment& one, const LineSegment& other) {
  const Vector2d way = (other.to_px - other.from_px).normalized();
  const auto off = [&](const Vector2d& p) {
    return std::abs(way.x() * (p - other.from_px).y() - way.y() * (p - other.from_px).x());
  };
  return kPixel_mm * std::max(off(one.from_px), off(one.to_px));
}
double worst_mm(const true_borders::Borders& borders, const ShaftLines& exact) {
  return std::max(apart_mm(borders.left, exact.left), apart_mm(borders.right, exact.right));
}

TEST(TrueBorders, OfACylinderAreTheLinesThatTouchIt) {
  const Mesh model = cylinder();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  double worst = 0;
  for (int i = 0; i < 40; ++i) {
    const Camera camera = radiograph::camera(180 * unit(random));
    const RigidTransform pose = posed({15 * unit(random), 15 * unit(random), 90 * unit(random)},
                                      {30 * unit(random), 30 * unit(random), 20 * unit(random)});
    const ShaftLines exact = tube::borders(camera, pose.translation_mm, pose.rotation.col(2), kRadius_mm, 100, 400);
    const auto borders = true_borders::borders_beside(exact, model, pose, camera, 1);
    ASSERT_TRUE(borders);
    worst = std::max(worst, worst_mm(*borders, exact));
    const Vector2d between = 0.5 * (exact.right.from_px + exact.right.to_px - exact.left.from_px - exact.left.to_px);
    const Vector2d along =
        (exact.left.from_px + exact.right.from_px - exact.left.to_px - exact.right.to_px).normalized();
    EXPECT_NEAR(kPixel_mm * borders->width_px, kPixel_mm * std::abs(along.x() * between.y() - along.y() * between.x()),
                kLimit_mm);
  }
  std::printf("cylinders: off by %.5f mm at most\n", worst);
  EXPECT_LT(worst, kLimit_mm);
}

TEST(TrueBorders, OfAConeAreTheLinesThatTouchIt) {
  for (const double slope : {-0.08, -0.03, 0.03, 0.08}) {
    const Mesh model = tube::mesh(
        150, [=](double z, double) { return kRadius_mm + slope * z; }, [](double) { return Vector3d(0, 0, 0); }, 360,
        60);
    for (const double angle : {0.0, 35.0, 90.0}) {
      const Camera camera = radiograph::camera(angle);
      const RigidTransform pose = posed({8, -6, 20}, {12, -25, 5});
      const cone::Cone known{pose * Vector3d(0, 0, -kRadius_mm / slope), (slope > 0 ? 1 : -1) * pose.rotation.col(2),
                             std::atan(std::abs(slope))};
      const ShaftLines exact = cone::borders(camera, known, 120, 380);
      const auto borders = true_borders::borders_beside(exact, model, pose, camera, 1);
      ASSERT_TRUE(borders);
      EXPECT_LT(worst_mm(*borders, exact), kLimit_mm) << slope << ", " << angle;
    }
  }
}

// Those of a box are the images of its edges, to the last digits.
TEST(TrueBorders, OfABoxAreItsEdges) {
  const Camera camera = radiograph::camera(0);  // along +y
  const Mesh model = box({0, 0, 0}, {20, 30, 200});
  const auto edge = [&](double x) {
    return LineSegment{project(camera, {x, -15, 50}), project(camera, {x, -15, -50})};
  };
  ShaftLines edges;
  edges.left = edge(10), edges.right = edge(-10);  // they run down
  const auto borders = true_borders::borders_beside(edges, model, posed({0, 0, 0}, {0, 0, 0}), camera, 3 * kPixel_mm);
  ASSERT_TRUE(borders);
  EXPECT_LT(worst_mm(*borders, edges), 1e-9);
  EXPECT_NEAR(borders->width_px, 20 * camera.intrinsics(0, 0) / 585, 1e-9);
}

TEST(TrueBorders, DoNotDependOnThePairBeside) {
  const Camera camera = radiograph::camera(0);
  const RigidTransform pose = posed({5, -4, 0}, {6, -9, 0});
  const ShaftLines exact = tube::borders(camera, pose.translation_mm, pose.rotation.col(2), kRadius_mm, 100, 400);
  for (const double turn_deg : {-3.0, 0.0, 3.0})
    for (const double shift_px : {-20.0, 20.0}) {
      ShaftLines pair = exact;
      for (LineSegment* border : {&pair.left, &pair.right})
        for (Vector2d* end : {&border->from_px, &border->to_px})
          *end = Eigen::Rotation2Dd(radians(turn_deg)) * (*end - Vector2d(256, 256)) + Vector2d(256 + shift_px, 256);
      const auto borders = true_borders::borders_beside(pair, cylinder(), pose, camera, 3 * kPixel_mm);
      ASSERT_TRUE(borders);
      EXPECT_LT(worst_mm(*borders, exact), kLimit_mm);
    }
}

// A fragment's surface ends where it broke, and all vertices of the bone may still be in its list. In the last pixels
// before an end that leans, the outline is that of the break.
TEST(TrueBorders, OfASurfaceThatEndsAreThoseOfItsPart) {
  const Camera camera = radiograph::camera(90);
  const RigidTransform pose = posed({3, 7, 0}, {4, 5, 0});
  const ShaftLines exact = tube::borders(camera, pose.translation_mm, pose.rotation.col(2), kRadius_mm, 100, 400);
  Mesh part = cylinder();
  std::erase_if(part.triangles, [&](const auto& t) { return part.vertices_mm[t[0]].z() > 10; });
  const auto borders = true_borders::borders_beside(exact, part, pose, camera, 3 * kPixel_mm);
  ASSERT_TRUE(borders);
  EXPECT_LT(worst_mm(*borders, exact), 0.05);
}

TEST(TrueBorders, WhatFlaresFartherThanTheToleranceIsNoShaft) {
  const Mesh model = tube::mesh(
      100, [](double z, double) { return kRadius_mm + std::max(0.0, z - 30); },
      [](double) { return Vector3d(0, 0, 0); }, 360, 400);
  const Camera camera = radiograph::camera(0);
  const ShaftLines exact = tube::borders(camera, {0, 0, 0}, {0, 0, 1}, kRadius_mm, 140, 400);  // z up to 41 mm
  const RigidTransform pose = posed({0, 0, 0}, {0, 0, 0});
  const auto within = [&](double tolerance_mm) {
    return worst_mm(*true_borders::borders_beside(exact, model, pose, camera, tolerance_mm), exact);
  };
  std::printf("a flare of 45 degrees: off by %.3f mm, without tolerance %.3f mm\n", within(1), within(100));
  EXPECT_LT(within(1), 0.1);
  EXPECT_GT(within(100), 1);
}

TEST(TrueBorders, NeedTheSurfaceInAThirdOfTheStretch) {
  const Camera camera = radiograph::camera(0);
  const ShaftLines pair = tube::borders(camera, {0, 0, 0}, {0, 0, 1}, kRadius_mm, 56, 456);  // 140.6 mm
  const auto shown = [&](double half_mm, const Vector3d& at) {
    return true_borders::borders_beside(pair, cylinder(half_mm), posed({0, 0, 0}, at), camera, 3 * kPixel_mm)
        .has_value();
  };
  EXPECT_TRUE(shown(25, {0, 0, 0}));
  EXPECT_FALSE(shown(22, {0, 0, 0}));
  EXPECT_FALSE(shown(100, {0, 0, 300}));
  EXPECT_FALSE(shown(100, {0, -1000, 0}));  // behind the source
  EXPECT_FALSE(true_borders::borders_beside({}, cylinder(), posed({0, 0, 0}, {0, 0, 0}), camera, 3 * kPixel_mm));
}

}  // namespace marrow::test::true_borders_test
