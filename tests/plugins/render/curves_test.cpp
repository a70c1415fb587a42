// SPDX-License-Identifier: Apache-2.0
#include "tests/harness/node_test.hpp"

namespace marrow::test::curves_test {

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

}  // namespace marrow::test::curves_test
