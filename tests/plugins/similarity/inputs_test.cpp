// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/inputs.hpp"

#include <gtest/gtest.h>

namespace inputs_test {

/// The outline of a rectangle. Two opposite sides belong to it. It may be open above, where the CT ends. It may reach
/// beyond the image, which the contract forbids.
class RectangleOutline : public marrow::OutlineProjector {
 public:
  RectangleOutline(int left, int right, int top, int bottom, bool is_open_above)
      : left_(left), right_(right), top_(top), bottom_(bottom), is_open_above_(is_open_above) {}
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform&,
                                            double) const override {
    std::vector<marrow::OutlinePoint> points;
    for (int v = top_; v <= bottom_ && is_open_above_; ++v) {
      points.push_back({float(left_), float(v), -1, 0});
      points.push_back({float(right_), float(v), 1, 0});
    }
    for (int u = left_; u <= right_ && !is_open_above_; ++u) {
      points.push_back({float(u), float(top_), 0, -1});
      points.push_back({float(u), float(bottom_), 0, 1});
    }
    return points;
  }

 private:
  int left_, right_, top_, bottom_;
  bool is_open_above_;
};

TEST(WithoutShadows, FillsAnOutlineInsideTheImageAlone) {
  constexpr int kColumns = 20, kRows = 12;
  marrow::View view;
  view.image.pixels = cv::Mat(kRows, kColumns, CV_8U, cv::Scalar(100));
  marrow::List<marrow::View> views;
  views.add("ap", view);
  // Inside the image, beyond one border, beyond the other, and beyond both.
  for (const auto& [first, last] : std::vector<std::pair<int, int>>{{3, 7}, {-5, 4}, {9, 25}, {-5, 25}})
    for (const bool is_open_above : {true, false}) {
      const int left = is_open_above ? first : 4, right = is_open_above ? last : 8, top = is_open_above ? 4 : first,
                bottom = is_open_above ? 8 : last;
      const RectangleOutline outline(left, right, top, bottom, is_open_above);
      const auto masked = marrow::match::without_shadows(views, {{&outline, {}}});
      for (int v = 0; v < kRows; ++v)
        for (int u = 0; u < kColumns; ++u)
          EXPECT_EQ(masked[0].mask.at<std::uint8_t>(v, u) == 0, v >= top && v <= bottom && u >= left && u <= right)
              << first << " to " << last << " at " << u << ' ' << v;
    }
}

}  // namespace inputs_test
