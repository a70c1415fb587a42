// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "tests/plugins/shaft/scenes.hpp"

namespace marrow::test::shaft_test {

using namespace scenes;

INSTANTIATE_TEST_SUITE_P(, Shaft, testing::Values("hough_pairs", "line_segments", "ransac"),
                         [](const auto& node) { return node.param; });

TEST_P(Shaft, DeclaresADeviationForEachWidth) {
  EXPECT_TRUE(declares(node(), same_length({"width_mm", "width_deviation_mm"})));
}

TEST_P(Shaft, SaysWhatIsWrongWithItsInputs) {
  EXPECT_EQ(MESSAGE_OF(find_shaft(no_edges(), empty_view())),
            "view 'frontal': the edge map is empty, so there is no shaft in it; look at the image, and lower the "
            "thresholds of the edge detector");
  EdgeMap edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);
  EXPECT_EQ(
      MESSAGE_OF(find_shaft(edges, empty_view(256))),
      "view 'frontal': the edge map is for 512 x 512 pixels, the view has 256 x 256; wire the edges of this view");
}

// Exact drawn lines, for the nodes that find their lines in the edge map alone.

class DrawnShaft : public Shaft {
 protected:
  /// Exactly drawn lines differ from those of a round bone.
  ShaftLines find_drawn(const EdgeMap& edges, const View& view) const {
    return find_shaft(edges, view, {{"outline", false}});
  }
};

INSTANTIATE_TEST_SUITE_P(, DrawnShaft, testing::Values("hough_pairs", "ransac"),
                         [](const auto& node) { return node.param; });

TEST_P(DrawnShaft, EndsWhereOneBorderEnds) {
  EdgeMap edges = no_edges();  // 85 px are 29.9 mm; condyles bend away below v = 300 on one side
  draw(edges, {200, 20}, {200, 480}, kLeft);
  draw(edges, {285, 20}, {285, 300}, kRight);
  draw(edges, {286, 301}, {380, 380}, kRight);
  const ShaftLines lines = find_drawn(edges, dark_between(200, 285));
  EXPECT_NEAR(lines.left.from_px.y(), 20, 2);
  EXPECT_NEAR(lines.left.to_px.y(), 300, 6);
  EXPECT_NEAR(lines.left.from_px.x(), 285, 0.01);
  EXPECT_NEAR(lines.right.to_px.x(), 200, 0.01);
  EXPECT_NEAR(lines.width_mm, 85 * 0.6 * 300 / 512, 0.01);
}

TEST_P(DrawnShaft, AllowsATaperAndPrefersTheLikelierWidth) {
  EdgeMap edges = no_edges();
  draw(edges, {200, 20}, {195, 400}, kLeft);
  draw(edges, {283, 20}, {290, 400}, kRight);
  draw(edges, {300, 20}, {307, 400}, kRight);  // 36 mm: allowed, but less likely
  View view = empty_view();
  for (int v = 0; v < 512; ++v) {
    const double part = (v - 20) / 380.0;
    for (int u = int(200 - 5 * part); u < 300 + 7 * part; ++u)
      view.image.pixels.at<std::uint16_t>(v, u) = u < 283 + 7 * part ? 500 : 700;
  }
  const ShaftLines lines = find_drawn(edges, view);
  EXPECT_NEAR(lines.width_mm, 89 * 0.6 * 300 / 512, 0.2);
  ASSERT_FALSE(lines.rejected.empty());
  EXPECT_HAS(lines.rejected[0].reason, "its log-likelihood of ");
  EXPECT_HAS(lines.rejected[0].reason, " is below the best one's ");
}

// A bowed shaft has many lines; their pairs must not crowd the shaft of a second fragment out of the list.
TEST_P(DrawnShaft, ListsTheShaftOfASecondFragment) {
  EdgeMap edges = no_edges();
  const auto bow = [](double v) { return 0.0008 * (v - 150) * (v - 150); };
  for (double v = 10; v < 300; v += 10)
    for (const auto& [u, side] : {std::pair(200.0, kLeft), std::pair(285.0, kRight)})
      draw(edges, {u + bow(v), v}, {u + bow(v + 10), v + 10}, side);
  draw(edges, {203, 360}, {196, 470}, kLeft);
  draw(edges, {282, 360}, {289, 470}, kRight);
  const ShaftLines lines = find_drawn(edges, dark_between(200, 285));
  EXPECT_LT(lines.left.to_px.y(), 310);
  int candidates = 0, in_second = 0;
  for (const auto& pair : lines.rejected) {
    if (pair.reason.find(" is below the best one's ") == std::string::npos) continue;
    ++candidates;
    in_second += pair.left.from_px.y() > 350;
  }
  std::printf("%d candidates, %d of them of the second fragment\n", candidates, in_second);
  EXPECT_GE(in_second, 1);
  EXPECT_LE(candidates, 3);
}

TEST_P(DrawnShaft, ToleratesGapsUpToTheLimit) {
  EdgeMap edges = no_edges();
  for (double v = 20; v < 400; v += 60) {  // gaps of 20 px = 7 mm
    draw(edges, {200, v}, {200, v + 40}, kLeft);
    draw(edges, {285, v}, {285, v + 40}, kRight);
  }
  EXPECT_NEAR(find_drawn(edges, dark_between(200, 285)).left.to_px.y(), 420, 3);
}

// A ridge of the bone lies outside the border of what is behind it.
TEST_P(DrawnShaft, EndsWhereItRunsOnInsideARidge) {
  EdgeMap edges = no_edges();
  draw(edges, {200, 20}, {200, 480}, kLeft);
  draw(edges, {285, 20}, {285, 480}, kRight);
  draw(edges, {295, 20}, {295, 200}, kRight);
  const ShaftLines lines = find_drawn(edges, dark_between(200, 285));
  EXPECT_NEAR(lines.left.from_px.y(), 200, 4);
  EXPECT_NEAR(lines.left.to_px.y(), 480, 4);
}

TEST_P(DrawnShaft, SaysWhyThereIsNoPair) {
  /// A vertical border from one v to another, with the bright side towards `bright`.
  struct Line {
    double u, from_v, to_v;
    Vector2d bright;
  };
  const auto said = [&](const std::vector<Line>& lines, const View& view) {
    EdgeMap edges = no_edges();
    for (const Line& line : lines) draw(edges, {line.u, line.from_v}, {line.u, line.to_v}, line.bright);
    const std::string advice = "; look at the edges, and set the edge detector's thresholds or this bone's width_mm",
                      text = MESSAGE_OF(find_shaft(edges, view));
    EXPECT_TRUE(text.starts_with("view 'frontal': no shaft pair found: ") && text.ends_with(advice)) << text;
    return text.substr(37, text.size() - std::min(text.size(), 37 + advice.size()));
  };
  const std::string rejected = "2 lines, best candidate rejected because ";
  EXPECT_EQ(said({{240, 20, 400, kRight}, {275, 20, 400, kLeft}}, empty_view()),  // the canal's polarity
            rejected + "it is darker outside than inside, as a canal or a gap between bones is (12.3 mm wide)");
  EXPECT_EQ(said({{40, 20, 400, kLeft}, {440, 20, 400, kRight}}, empty_view()),  // the thigh's outline
            rejected + "its width of 140.6 mm is too large for a shaft (17.2 to 49.9 mm), as the limb's is");
  const std::vector<Line> of_shafts_width{{200, 20, 400, kLeft}, {285, 20, 400, kRight}};
  EXPECT_EQ(said(of_shafts_width, dark_between(270, 330)),  // the dark is elsewhere
            rejected +
                "only 0 mm of its borders are clear enough for bone, of 25 mm wanted; muscle's are as faint "
                "(29.9 mm wide)");
  View rims = empty_view();  // two dark things with something bright between them
  rims.image.pixels.colRange(200, 212) = 800;
  rims.image.pixels.colRange(212, 273) = 1500;
  rims.image.pixels.colRange(273, 285) = 800;
  EXPECT_EQ(
      said(of_shafts_width, rims),
      rejected + "it is not darker than what lies beside it (mean grey value 1267 inside, 1000 and 1000 outside)");
  EXPECT_EQ(said({{200, 20, 110, kLeft}, {262, 20, 110, kRight}}, dark_between(200, 262)),  // short, and narrow
            rejected + "its log-likelihood of 1.7 is below 2.0, the least that is taken (21.8 mm wide)");
  EXPECT_EQ(said({{200, 20, 400, kLeft}, {285, 380, 500, kRight}}, empty_view()),
            rejected + "its borders run side by side for 7 mm only, of 25 mm wanted");
  EXPECT_EQ(said({{200, 20, 400, kLeft}}, empty_view()), "1 lines, none of which run side by side");
}

// How wide a shaft is, by how far away it is: similar triangles.

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
  const List<View> one = named("frontal", meeting_at(450, {0, 0, 0})[0]);
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

}  // namespace marrow::test::shaft_test
