// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "shipped.hpp"
#include "tests/plugins/evaluate/listener.hpp"

namespace common_offset_test {

using namespace marrow;
using shipped::figure;

constexpr int kSize_px = 300;
constexpr double kRadius_px = 60, kMiddle_px = 150;

/// Points around the middle of the image, from one angle to another.
class Arc : public OutlineProjector {
 public:
  explicit Arc(double to_deg = 360) : to_deg_(to_deg) {}
  std::vector<OutlinePoint> outline(const Camera&, const RigidTransform&, double) const override {
    std::vector<OutlinePoint> points;
    for (double deg = 0; deg < to_deg_; deg += 2) {
      const double c = std::cos(radians(deg)), s = std::sin(radians(deg));
      OutlinePoint point;
      point.u_px = float(kMiddle_px + kRadius_px * c), point.v_px = float(kMiddle_px + kRadius_px * s);
      point.normal_u = float(c), point.normal_v = float(s);
      points.push_back(point);
    }
    return points;
  }

 private:
  double to_deg_;
};

/// Edges on a circle. Those of the last eighth are 4 px farther out: another border.
EdgeMap circle(double radius_px, double u_px, double v_px, double side) {
  EdgeMap edges{kSize_px, kSize_px, {}};
  for (double deg = 0; deg < 360; deg += 0.7) {
    const double c = std::cos(radians(deg)), s = std::sin(radians(deg)), r = radius_px + (deg > 315 ? 4 : 0);
    edges.pixels.push_back({float(u_px + r * c), float(v_px + r * s), float(side * c), float(side * s), 10});
  }
  return edges;
}

shipped::Inputs inputs(const EdgeMap& edges, double to_deg = 360) {
  View view;
  view.name = "first";
  view.image.pixels = cv::Mat(kSize_px, kSize_px, CV_8U, cv::Scalar(128));
  view.camera.width_px = view.camera.height_px = kSize_px;
  view.camera.intrinsics << 1000, 0, 150, 0, 1000, 150, 0, 0, 1;
  List<View> views;
  views.add("first", view);
  List<EdgeMap> maps;
  maps.add("first", edges);
  return {{"pose", shipped::item(Pose())},
          {"projector", Value::of<OutlineProjector>(std::make_shared<const Arc>(to_deg))},
          {"views", shipped::list(views, "view")},
          {"edges", shipped::list(maps, "view")}};
}

class OutlineOffset : public testing::TestWithParam<double> {};  // the side on which the image is brighter

TEST_P(OutlineOffset, IsFoundInSpiteOfAnotherBorder) {
  const auto metrics =
      shipped::call("evaluate.outline_offset", inputs(circle(61.2, 150.5, 149.3, GetParam())), {{"polarity", "either"}})
          .at("metrics");
  EXPECT_NEAR(figure(metrics, "first_across_px"), 1.2, 0.1);
  EXPECT_NEAR(figure(metrics, "first_shift_u_px"), 0.5, 0.1);
  EXPECT_NEAR(figure(metrics, "first_shift_v_px"), -0.7, 0.1);
  EXPECT_LT(figure(metrics, "first_scatter_px"), 0.2);
}
INSTANTIATE_TEST_SUITE_P(Polarity, OutlineOffset, testing::Values(1.0, -1.0));

TEST(OutlineOffsetRefuses, EdgesThatSayNothing) {
  EXPECT_EQ(
      shipped::refusal("evaluate.outline_offset", inputs(circle(61, 150, 150, -1))),
      "view 'first': only 0 points of the outline have an edge within 6 px, and 20 are needed; check the pose, or "
      "raise reach_px");
  EXPECT_EQ(shipped::refusal("evaluate.outline_offset", inputs(circle(61, 150, 150, 1), 50), {{"reach_px", 7.0}}),
            "view 'first': all of the outline runs in one direction, which does not tell an offset across it from a "
            "shift; leave this view out");
}

List<Metrics> frames(const std::vector<double>& x_mm, const std::vector<double>& axial_deg) {
  List<Metrics> list;
  for (std::size_t i = 0; i < x_mm.size(); ++i)
    list.add(std::to_string(i + 1), Metrics{{{"x_mm", x_mm[i], "mm"}, {"axial_deg", axial_deg[i], "deg"}}});
  return list;
}

// Mean 0.5; deviations -0.1, 0.1, -0.1, 0.1: variance 0.04 / 3.
TEST(CommonOffset, IsToldFromWhatDiffersBetweenFrames) {
  listener::Listener listener;
  const auto metrics =
      shipped::call("evaluate.common_offset",
                    {{"metrics", shipped::list(frames({0.4, 0.6, 0.4, 0.6}, {-2, 2, -1, 1}), "frame")}}, {},
                    listener.context)
          .at("metrics");
  EXPECT_EQ(figure(metrics, "frames"), 4);
  EXPECT_NEAR(figure(metrics, "common_x_mm"), 0.5, 1e-12);
  EXPECT_NEAR(figure(metrics, "rest_x_mm"), std::sqrt(0.04 / 3), 1e-12);
  EXPECT_NEAR(figure(metrics, "error_x_mm"), std::sqrt(0.04 / 3) / 2, 1e-12);
  EXPECT_NEAR(figure(metrics, "common_axial_deg"), 0, 1e-12);
  EXPECT_EQ(listener.warnings,
            std::vector<std::string>{
                "all 4 frames have in common: x_mm 0.5 mm, known to 0.058; without it they scatter by 0.12"});
}

TEST(CommonOffset, RefusesWhatTellsNothing) {
  const auto refusal = [](const List<Metrics>& list, const shipped::Options& options = {}) {
    return shipped::refusal("evaluate.common_offset", {{"metrics", shipped::list(list, "frame")}}, options);
  };
  EXPECT_EQ(refusal(frames({1, 2}, {1, 2})),
            "there are 2 frames; it takes at least 3 to tell what they have in common");
  EXPECT_EQ(refusal(frames({1, 2, std::nan("")}, {1, 2, 3})),
            "frame '3': 'x_mm' is no finite number; leave this frame out");
  EXPECT_EQ(refusal(frames({1, 2, 3}, {1, 2, 3}), {{"figures", std::vector<std::string>{"y_mm"}}}),
            "frame '1' has no figure 'y_mm'; did you mean 'x_mm'?");
}

}  // namespace common_offset_test
