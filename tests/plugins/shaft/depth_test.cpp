// SPDX-License-Identifier: Apache-2.0
// How wide a shaft is, by how far away it is: similar triangles.
#include "tests/plugins/shaft/scenes.hpp"

namespace marrow::test::depth_test {

using namespace scenes;

class DeepShaft : public Shaft {
 protected:
  /// The borders at u = 200 and 285, with the views that are wired.
  ShaftLines found(const View& view, const List<View>& views, const Options& options, const Heard& listener) const {
    EdgeMap edges = no_edges();
    draw(edges, {200, 20}, {200, 480}, kLeft);
    draw(edges, {285, 20}, {285, 480}, kRight);
    Inputs inputs{{"edges", item(edges)}, {"view", item(view)}};
    if (!views.empty()) inputs["views"] = shipped::list(views, "view");
    Options all = options;
    all["outline"] = false;
    return output<ShaftLines>(node(), "lines", inputs, all, listener.context);
  }
};
INSTANTIATE_TEST_SUITE_P(, DeepShaft, testing::Values("hough_pairs", "ransac"),
                         [](const auto& node) { return node.param; });

/// mm of a pixel of the detector, 1000 mm from the source.
constexpr double kPixel_mm = 300.0 / 512;

/// Two views that meet at a point, each from this far away.
List<View> meeting_at(double distance_mm, const Vector3d& point_mm) {
  List<View> views;
  for (const double angle : {0.0, 90.0}) {
    View view = dark_between(200, 285);
    view.name = angle == 0 ? "frontal" : "lateral";
    view.camera = radiograph::camera(angle);
    view.camera.camera_from_world.translation_mm =
        Vector3d(0, 0, distance_mm) - view.camera.camera_from_world.rotation * point_mm;
    views.add(view.name, view);
  }
  return views;
}

TEST_P(DeepShaft, LiesWhereTheViewsMeet) {
  const Heard listener;
  for (const double distance_mm : {500.0, 700.0}) {
    const auto views = meeting_at(distance_mm, {80, -300, 170});
    EXPECT_NEAR(found(views[0], views, {}, listener).width_mm, 85 * kPixel_mm * distance_mm / 1000, 0.01);
  }
  EXPECT_TRUE(listener.warnings.empty());
}

TEST_P(DeepShaft, LiesAsFarAwayAsIsSaid) {
  const Heard listener;
  const auto views = meeting_at(500, {0, 0, 0});
  EXPECT_NEAR(found(views[0], views, {{"source_to_shaft_mm", 650.0}}, listener).width_mm, 85 * kPixel_mm * 0.65, 0.01);
  EXPECT_NEAR(found(views[0], {}, {{"source_to_shaft_mm", 650.0}}, listener).width_mm, 85 * kPixel_mm * 0.65, 0.01);
  EXPECT_TRUE(listener.warnings.empty());
}

TEST_P(DeepShaft, OfASingleViewLiesAtAUsualDistanceWithAWarning) {
  const Heard listener;
  List<View> one;
  one.add("frontal", meeting_at(450, {0, 0, 0})[0]);
  EXPECT_NEAR(found(one[0], one, {}, listener).width_mm, 85 * kPixel_mm * 0.6, 0.01);
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_EQ(listener.warnings[0],
            "view 'frontal': how far the shaft is from the X-ray source is not known; 600 mm are assumed, and all its "
            "lengths in mm depend on this. Wire 'views' with two views or more, or set source_to_shaft_mm");
}

// Pixels twice as high as wide do not change the width of a shaft that is upright in the image.
TEST_P(DeepShaft, IsAsWideWithPixelsThatAreNotSquare) {
  const Heard listener;
  View view = meeting_at(600, {0, 0, 0})[0];
  view.camera.intrinsics.row(1) *= 0.5;
  EXPECT_NEAR(found(view, {}, {{"source_to_shaft_mm", 600.0}}, listener).width_mm, 85 * kPixel_mm * 0.6, 0.01);
}

}  // namespace marrow::test::depth_test
