// SPDX-License-Identifier: Apache-2.0
#include "plugins/similarity/inputs.hpp"

#include <gtest/gtest.h>

namespace {

/// A rectangle of columns and rows, both ends of which belong to it. It may reach beyond the image, against the contract.
class RectangleOutline : public marrow::Projector {
 public:
  RectangleOutline(int left, int right, int top, int bottom) : left_(left), right_(right), top_(top), bottom_(bottom) {}
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform&, double) const override {
    std::vector<marrow::OutlinePoint> points;
    for (int v = top_; v <= bottom_; ++v) {
      points.push_back({float(left_), float(v), -1, 0});
      points.push_back({float(right_), float(v), 1, 0});
    }
    return points;
  }

 private:
  int left_, right_, top_, bottom_;
};

TEST(WithoutShadows, FillsAnOutlineInsideTheImageAlone) {
  constexpr int kColumns = 20, kRows = 12;
  marrow::View view;
  view.image.pixels = cv::Mat(kRows, kColumns, CV_8U, cv::Scalar(100));
  marrow::List<marrow::View> views;
  views.add("ap", view);
  // Inside, over the left border, over the right one, and over both.
  for (const auto& [left, right] : std::vector<std::pair<int, int>>{{3, 7}, {-5, 4}, {15, 25}, {-5, 25}}) {
    const RectangleOutline outline(left, right, 4, 8);
    const auto masked = marrow::similarity::without_shadows(views, {{&outline, {}}});
    for (int v = 0; v < kRows; ++v)
      for (int u = 0; u < kColumns; ++u)
        EXPECT_EQ(masked[0].mask.at<std::uint8_t>(v, u) == 0, v >= 4 && v <= 8 && u >= left && u <= right) << left << " to " << right << " at " << u << ' ' << v;
  }
}

}  // namespace
