// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/initial/tube.hpp"

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
  EXPECT_EQ(heard.warnings,
            Strings{"view 'frontal': no fragment of known pose lies where the pair of borders was found, so there is "
                    "nothing to compare it with"});
}

}  // namespace marrow::test::shaft_lines_test
