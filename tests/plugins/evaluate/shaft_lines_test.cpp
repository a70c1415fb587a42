// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "shipped.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/evaluate/listener.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace shaft_lines_test {

using listener::Listener;
using marrow::List, marrow::Mesh, marrow::ShaftLines, marrow::Truth, marrow::View;

constexpr double kRadius_mm = 14;

View frontal() {
  View view;
  view.name = "frontal";
  view.camera = radiograph::camera(0);
  return view;
}

struct Bone {
  List<Mesh> models;
  List<Truth> truths;
};

/// A cylinder along the world's z axis, at its true place.
Bone bone() {
  Bone bone;
  bone.models.add("distal", tube::cylinder(kRadius_mm, 200));
  Truth truth;
  truth.world_from_model = {"world", "model"};
  bone.truths.add("distal", truth);
  return bone;
}

ShaftLines borders(const View& view, double radius_mm = kRadius_mm) {
  return tube::borders(view.camera, {0, 0, 0}, Eigen::Vector3d::UnitZ(), radius_mm, 100, 400);
}

marrow::Value compared(const ShaftLines& lines, const List<Mesh>& models, const List<Truth>& truths,
                       const Listener& listener) {
  return shipped::call("evaluate.shaft_lines",
                       {{"lines", shipped::item(lines)},
                        {"view", shipped::item(frontal())},
                        {"models", shipped::list(models, "fragment")},
                        {"truths", shipped::list(truths, "fragment")}},
                       {}, listener.context)
      .at("metrics");
}

double figure(const ShaftLines& lines, const std::string& name) {
  const Listener listener;
  const Bone truth = bone();
  const auto metrics = compared(lines, truth.models, truth.truths, listener);
  return metrics.is_absent() ? std::nan("") : shipped::figure(metrics, name);
}

TEST(EvaluateShaftLines, ExactBordersHaveNoError) {
  const ShaftLines lines = borders(frontal());
  EXPECT_LT(figure(lines, "border_angle_deg"), 0.01);
  EXPECT_LT(figure(lines, "border_offset_mm"), 0.01);
  EXPECT_LT(figure(lines, "worst_mm"), 0.02);
  EXPECT_LT(figure(lines, "axis_offset_mm"), 0.01);
  EXPECT_NEAR(figure(lines, "width_error_mm"), 0, 0.02);
}

TEST(EvaluateShaftLines, NarrowerOnesLieInside) {
  const ShaftLines lines = borders(frontal(), kRadius_mm - 0.5);
  EXPECT_NEAR(figure(lines, "border_offset_mm"), 0.5, 0.02);
  EXPECT_NEAR(figure(lines, "width_error_mm"), -1, 0.04);
  EXPECT_LT(figure(lines, "axis_offset_mm"), 0.01);
}

TEST(EvaluateShaftLines, APairThatIsOnePercentTooWideSaysSo) {
  const ShaftLines lines = borders(frontal(), 1.01 * kRadius_mm);
  EXPECT_NEAR(figure(lines, "width_error_mm"), 0.28, 0.01);
  EXPECT_NEAR(figure(lines, "true_width_mm"), 28, 0.02);
}

TEST(EvaluateShaftLines, OneThatIsTurnedSaysByHowMuch) {
  ShaftLines lines = borders(frontal());
  const Eigen::Vector2d middle = 0.5 * (lines.left.from_px + lines.left.to_px);
  for (Eigen::Vector2d* end : {&lines.left.from_px, &lines.left.to_px})
    *end = middle + Eigen::Rotation2Dd(marrow::radians(1)) * (*end - middle);
  EXPECT_NEAR(figure(lines, "border_angle_deg"), 1, 0.02);
  EXPECT_NEAR(figure(lines, "axis_angle_deg"), 0.5, 0.02);
  EXPECT_NEAR(figure(lines, "worst_mm"), 150 * std::sin(marrow::radians(1)) * 0.6 * 300 / 512, 0.05);
}

TEST(EvaluateShaftLines, LengthsAndWidths) {
  ShaftLines lines = borders(frontal());
  lines.log_likelihood = -3.5;
  const double pixel_mm = 0.6 * 300 / 512;
  EXPECT_NEAR(figure(lines, "length_mm"), pixel_mm * (lines.left.to_px - lines.left.from_px).norm(), 0.05)
      << "the outline is 0.3 mm before the axis, which is at 600 mm";
  EXPECT_NEAR(figure(lines, "true_width_mm"), pixel_mm * (lines.left.from_px - lines.right.from_px).norm(), 0.02);
  EXPECT_EQ(figure(lines, "log_likelihood"), -3.5);
}

TEST(EvaluateShaftLines, TheWorseOfTheTwoBordersCounts) {
  // The right one 0.9 mm outwards and turned by half a degree to the other side.
  for (const bool left : {true, false}) {
    ShaftLines lines = borders(frontal());
    marrow::LineSegment& moved = left ? lines.left : lines.right;
    const double shift_px = 0.9 / (0.6 * 300 / 512);
    const Eigen::Vector2d outwards = (left ? 1 : -1) * (lines.left.from_px - lines.right.from_px).normalized();
    const Eigen::Vector2d middle = 0.5 * (moved.from_px + moved.to_px) + shift_px * outwards;
    const Eigen::Vector2d half = Eigen::Rotation2Dd(marrow::radians(-0.5)) * (0.5 * (moved.to_px - moved.from_px));
    moved = {middle - half, middle + half};
    EXPECT_NEAR(figure(lines, "border_offset_mm"), 0.9, 0.02);
    EXPECT_NEAR(figure(lines, "border_angle_deg"), 0.5, 0.02);
    EXPECT_NEAR(figure(lines, "axis_offset_mm"), 0.45, 0.02);
    EXPECT_NEAR(figure(lines, "axis_angle_deg"), 0.25, 0.02);
    EXPECT_NEAR(figure(lines, "width_error_mm"), 0.9, 0.04);
    EXPECT_NEAR(figure(lines, "worst_mm"), 0.9 + 150 * std::sin(marrow::radians(0.5)) * 0.6 * 300 / 512, 0.05);
  }
}

TEST(EvaluateShaftLines, AgainstTheFragmentWhoseOutlineIsNearest) {
  Listener listener;
  Bone truth = bone();
  for (const char* name : {"far", "near", "unknown"}) {
    truth.models.add(name, tube::cylinder(kRadius_mm, 200));
    Truth shifted;
    shifted.world_from_model = {"world", "model"};
    shifted.world_from_model.translation_mm.x() = name == std::string("near") ? 0.3 : 4;
    if (name != std::string("unknown")) truth.truths.add(name, shifted);
  }
  Truth off;
  off.world_from_model = {"world", "model"};
  off.world_from_model.translation_mm.x() = -2;
  List<Truth> truths;
  truths.add("distal", off);
  truths.add("far", truth.truths[1]);
  truths.add("near", truth.truths[2]);
  const auto metrics = compared(borders(frontal()), truth.models, truths, listener);
  ASSERT_FALSE(metrics.is_absent());
  const marrow::Metric& second = metrics.as<marrow::Metrics>().items[1];
  EXPECT_NEAR(second.value, 0.3, 0.02) << second.name;
}

TEST(EvaluateShaftLines, WithoutABoneThereTheyCannotBeCompared) {
  Listener listener;
  EXPECT_TRUE(compared(borders(frontal()), {}, {}, listener).is_absent());
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_EQ(listener.warnings[0],
            "view 'frontal': no fragment of known pose lies where the pair of borders was found, so there is nothing "
            "to compare it with");
}

}  // namespace shaft_lines_test
