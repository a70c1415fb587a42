// SPDX-License-Identifier: Apache-2.0
// Exact drawn lines, for the nodes that find their lines in the edge map alone.
#include <cstdio>

#include "tests/plugins/shaft/scenes.hpp"

namespace marrow::test::drawn_test {

using namespace scenes;

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
  EXPECT_NE(lines.rejected[0].reason.find("its log-likelihood of "), std::string::npos);
  EXPECT_NE(lines.rejected[0].reason.find(" is below the best one's "), std::string::npos);
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
  const std::string advice = "; look at the edges, and set the edge detector's thresholds or this bone's width_mm";
  EdgeMap edges = no_edges();
  draw(edges, {240, 20}, {240, 400}, kRight);  // the canal's polarity
  draw(edges, {275, 20}, {275, 400}, kLeft);
  EXPECT_EQ(message_of([&] { find_shaft(edges, empty_view()); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because it is darker outside than "
            "inside, as a canal or a gap between bones is (12.3 mm wide)" +
                advice);
  edges = no_edges();
  draw(edges, {40, 20}, {40, 400}, kLeft);  // the thigh's outline
  draw(edges, {440, 20}, {440, 400}, kRight);
  EXPECT_EQ(message_of([&] { find_shaft(edges, empty_view()); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because its width of 140.6 mm is "
            "too large for a shaft (17.2 to 49.9 mm), as the limb's is" +
                advice);
  edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);  // of a shaft's width, but the dark is elsewhere
  draw(edges, {285, 20}, {285, 400}, kRight);
  EXPECT_EQ(message_of([&] { find_shaft(edges, dark_between(270, 330)); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because only 0 mm of its borders "
            "are clear enough for bone, of 25 mm wanted; muscle's are as faint (29.9 mm wide)" +
                advice);
  View rims = empty_view();  // two dark things with something bright between them
  rims.image.pixels.colRange(200, 212) = 800;
  rims.image.pixels.colRange(212, 273) = 1500;
  rims.image.pixels.colRange(273, 285) = 800;
  EXPECT_EQ(message_of([&] { find_shaft(edges, rims); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because it is not darker than what "
            "lies beside it (mean grey value 1267 inside, 1000 and 1000 outside)" +
                advice);
  edges = no_edges();  // short, and narrow for a femur
  draw(edges, {200, 20}, {200, 110}, kLeft);
  draw(edges, {262, 20}, {262, 110}, kRight);
  EXPECT_EQ(message_of([&] { find_shaft(edges, dark_between(200, 262)); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because its log-likelihood of 1.7 "
            "is below 2.0, the least that is taken (21.8 mm wide)" +
                advice);
  edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);
  draw(edges, {285, 380}, {285, 500}, kRight);
  EXPECT_EQ(message_of([&] { find_shaft(edges, empty_view()); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because its borders run side by "
            "side for 7 mm only, of 25 mm wanted" +
                advice);
  edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);
  EXPECT_EQ(message_of([&] { find_shaft(edges, empty_view()); }),
            "view 'frontal': no shaft pair found: 1 lines, none of which run side by side" + advice);
}

}  // namespace marrow::test::drawn_test
