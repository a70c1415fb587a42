// SPDX-License-Identifier: Apache-2.0
#include "marrow/render/plot.hpp"
#include "tests/plugins/render/pictures.hpp"

namespace marrow::test::plots_test {

using namespace draw;
using Profile = Landscape::Profile;

List<Metrics> frames(double slope) {
  List<Metrics> list;
  for (int i = 0; i < 20; ++i)
    list.add(std::to_string(i), Metrics{{{"flexion_deg", slope * i, "deg"}, {"shift_mm", 1, "mm"}}});
  return list;
}

cv::Mat drawn(const List<Metrics>& metrics, const Options& options = {}) {
  return output<Picture>("render.curves", "picture", {{"metrics", shipped::list(metrics, "frame")}}, options).pixels;
}

/// The mean row of the blue curve in the left or right third of the first plot.
double height(const cv::Mat& picture, bool right) {
  double sum = 0, count = 0;
  for (int v = 40; v < 220; ++v)
    for (int u = right ? 350 : 100; u < (right ? 470 : 220); ++u) {
      const cv::Vec3b colour = picture.at<cv::Vec3b>(v, u);
      if (colour[2] > colour[0] + 100) sum += v, ++count;
    }
  return sum / count;
}

TEST(Curves, RiseAndFallAsTheFiguresDo) {
  const cv::Mat rising = drawn(frames(2)), falling = drawn(frames(-2));
  EXPECT_EQ(rising.size(), cv::Size(1500, 260)) << "three in a row";
  EXPECT_LT(height(rising, true), height(rising, false) - 50);
  EXPECT_GT(height(falling, true), height(falling, false) + 50);
}

TEST(Curves, SayWhatIsMissing) {
  EXPECT_EQ(
      refusal("render.curves", {{"metrics", shipped::list(frames(1), "frame")}}, {{"figures", Strings{"flexion"}}}),
      "there is no figure 'flexion'; there are flexion_deg, shift_mm");
  EXPECT_EQ(refusal("render.curves", {{"metrics", shipped::list(List<Metrics>(), "frame")}}),
            "there is no frame to draw");
}

/// Parabolas (x - 2.5)^2 over -10 to 10, their truth at +5.
Landscape parabolas() {
  Landscape landscape;
  for (int axis = 0; axis < 6; ++axis) {
    Profile profile{"rotation about the long axis", "deg", {}, {}, 5.0};
    for (int i = 0; i <= 80; ++i) {
      profile.offsets.push_back(0.25 * i - 10);
      profile.costs.push_back((profile.offsets.back() - 2.5) * (profile.offsets.back() - 2.5));
    }
    landscape.profiles.push_back(profile);
  }
  return landscape;
}

cv::Mat draw(const Landscape& landscape) {
  return output<Picture>("render.landscape", "picture", {{"landscape", item(landscape)}}).pixels;
}

/// Whether the first plot has this title, above its axes and to the right of the label of its costs.
bool is_titled(const cv::Mat& picture, const std::string& title) {
  cv::Mat canvas(300, 500, CV_8UC3);
  Plot plot;
  plot.title = title;
  draw_plot(canvas, {0, 0, 500, 300}, plot);
  const cv::Rect above(60, 0, 440, 26);
  return pictures::same(picture(above), canvas(above));
}

TEST(Landscape, TitleSaysWhereTheCostIsLeast) {
  const cv::Mat picture = draw(parabolas());
  EXPECT_TRUE(is_titled(picture, "rotation about the long axis: least at +2.50 deg"));
  EXPECT_FALSE(is_titled(picture, "rotation about the long axis: least at +2.50 mm"));
}

TEST(Landscape, DrawsSixPlotsWithTheirMarks) {
  const cv::Mat picture = draw(parabolas());
  EXPECT_EQ(picture.cols, 3 * 500);
  EXPECT_GT(picture.rows, 600);
  const auto count = [&](const cv::Rect& area, const cv::Scalar& colour) {
    int pixels = 0;
    for (int y = area.y; y < area.br().y; ++y)
      for (int x = area.x; x < area.br().x; ++x)
        pixels += picture.at<cv::Vec3b>(y, x) == cv::Vec3b(uchar(colour[0]), uchar(colour[1]), uchar(colour[2]));
    return pixels;
  };
  for (int axis = 0; axis < 6; ++axis)
    EXPECT_GT(count({axis % 3 * 500, axis / 3 * 300, 500, 300}, kBlue), 100) << "curve " << axis;
  // The axis of the first plot runs from 64 to 486 for -10 to +10 degrees: the truth at +5 lies at 380.5.
  EXPECT_GT(count({378, 28, 6, 228}, kOrange), 50);
}

TEST(Landscape, CostsThatAreNotFiniteGiveAPictureThatSaysSo) {
  const Landscape nothing{{{"rotation about the long axis", "deg", {-1, 0, 1}, {NAN, NAN, NAN}, {}}}};
  EXPECT_TRUE(is_titled(draw(nothing), "rotation about the long axis: no finite cost"));
  EXPECT_FALSE(draw({}).empty());
}

TEST(Plot, TicksAreRound) {
  EXPECT_EQ(round_ticks(-10, 10, 4), (Numbers{-10, -5, 0, 5, 10}));
  EXPECT_EQ(round_ticks(0.3, 4.2, 4), (Numbers{1, 2, 3, 4}));
  EXPECT_TRUE(round_ticks(1, 1, 4).empty());
  EXPECT_TRUE(round_ticks(0, std::nan(""), 4).empty());
}

}  // namespace marrow::test::plots_test
