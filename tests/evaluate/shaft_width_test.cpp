// SPDX-License-Identifier: Apache-2.0
#include "plugins/evaluate/shaft_width.cpp"

#include <gtest/gtest.h>

#include "edges/radiograph.hpp"
#include "initial/tube.hpp"
#include "shipped.hpp"

namespace {

/// Keeps what a node warns of.
struct Listener {
  std::vector<std::string> warnings;
  marrow::Context context{marrow::Context::Hooks{0, nullptr, {}, [this](std::string_view message, bool warning) {
                                                   if (warning) warnings.emplace_back(message);
                                                 }}};
};

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

double figure(const marrow::Metrics& metrics, const std::string& name) {
  for (const auto& item : metrics.items)
    if (item.name == name) return item.value;
  ADD_FAILURE() << "no figure " << name;
  return 0;
}

TEST(ShaftWidth, DeclaresADeviationForEachWidth) {
  EXPECT_TRUE(shipped::declares("evaluate.shaft_width", marrow::same_length({"width_mm", "width_deviation_mm"})));
}

TEST(ShaftWidth, IsExactWhereTheMagnificationIsNot) {
  const Scene scene = scene_of(14);
  Listener listener;
  const auto metrics = shaft_width(scene.lines, scene.views, {}, listener.context);
  ASSERT_TRUE(metrics);
  for (const std::string name : {"frontal", "lateral"}) {
    EXPECT_NEAR(figure(*metrics, name + "_width_mm"), 28, 1e-6);
    std::printf("%s: magnified by %.3f\n", name.c_str(), figure(*metrics, name + "_magnification"));
    EXPECT_GT(std::abs(figure(*metrics, name + "_magnification") - 1), 0.03);
  }
  EXPECT_TRUE(listener.warnings.empty());
}

TEST(ShaftWidth, WarnsWhereItIsNoShaft) {
  const Scene scene = scene_of(40);
  Listener listener;
  shaft_width(scene.lines, scene.views, {}, listener.context);
  ASSERT_EQ(listener.warnings.size(), 2u);
  EXPECT_EQ(
      listener.warnings[0],
      "view 'frontal': the borders are 80 mm apart at the depth where the views have the axis, which is no shaft's "
      "width (18.0 to 48.7 mm); one view's pair is another thing than the other's");
}

TEST(ShaftWidth, SaysWhatItNeeds) {
  Listener listener;
  const Scene one = scene_of(14, {0});
  EXPECT_FALSE(shaft_width(one.lines, one.views, {}, listener.context));
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_EQ(
      listener.warnings[0],
      "there are shaft lines of one view alone: where the bone lies between source and detector, and so its diameter, "
      "is not known");
  const Scene two = scene_of(14);
  try {
    shaft_width(two.lines, one.views, {}, listener.context);
    ADD_FAILURE() << "no error";
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(
        error.what(),
        "there are shaft lines of a view 'lateral', but no such view; wire the views that the lines were found in");
  }
}

}  // namespace
