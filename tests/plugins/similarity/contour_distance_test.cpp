// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <marrow/domain/case.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <vector>

#include "marrow/toolbox/match/nearest_outline.hpp"
#include "shipped.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace contour_distance_test {

/// An outline that is a straight upright line at u = 100 + the pose's x in mm, for v from 50 to 149. It faces left.
class LineProjector : public marrow::OutlineProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform& pose,
                                            double spacing_px) const override {
    std::vector<marrow::OutlinePoint> points;
    for (double v = 50; v < 150; v += spacing_px)
      points.push_back(
          {float(100 + pose.translation_mm.x()), float(v + pose.translation_mm.z()), -1, 0, Eigen::Vector3f::Zero()});
    return points;
  }
};

/// The same line, but every second point faces right.
class TwoSidedProjector : public LineProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera, const marrow::RigidTransform& pose,
                                            double spacing_px) const override {
    std::vector<marrow::OutlinePoint> points = LineProjector::outline(camera, pose, spacing_px);
    for (std::size_t i = 0; i < points.size(); i += 2) points[i].normal_u = 1;
    return points;
  }
};

marrow::List<marrow::View> one_view(const cv::Mat& mask = {}) {
  marrow::List<marrow::View> views;
  views.add("lateral", marrow::View{"lateral", {}, shapes::c_arm(0, 200), mask});
  return views;
}

/// Upright edges at u, with a gradient towards `direction`.
marrow::EdgeMap line_at(double u, float direction) {
  marrow::EdgeMap map{200, 200, {}};
  for (int v = 0; v < 200; ++v) map.pixels.push_back({float(u), float(v), direction, 0, 1});
  return map;
}

marrow::List<marrow::EdgeMap> edge_maps(const marrow::EdgeMap& map) {
  marrow::List<marrow::EdgeMap> edges;
  edges.add("lateral", map);
  return edges;
}

marrow::RigidTransform shifted(double x, double z = 0) {
  marrow::RigidTransform pose{"world", "ct"};
  pose.translation_mm = {x, 0, z};
  return pose;
}

shipped::Options fixed_offset(double offset_px = 0) {
  return {{"estimate_offset", false}, {"edge_offset_px", offset_px}, {"contour_spacing_px", 1.0}, {"reach_px", 10.0}};
}

const auto kLine = std::make_shared<const LineProjector>();

/// The inputs for one fragment alone.
shipped::Inputs inputs(const marrow::List<marrow::View>& views, const marrow::List<marrow::EdgeMap>& edges) {
  return {{"projector", marrow::Value::of<marrow::OutlineProjector>(kLine)},
          {"views", shipped::list(views, "view")},
          {"edges", shipped::list(edges, "view")}};
}

std::shared_ptr<const marrow::Cost> contour_distance(const marrow::List<marrow::View>& views,
                                                     const marrow::List<marrow::EdgeMap>& edges,
                                                     const shipped::Options& options) {
  return std::static_pointer_cast<const marrow::Cost>(
      shipped::call("similarity.contour_distance", inputs(views, edges), options).at("cost").data);
}

std::string message(const marrow::List<marrow::View>& views, const marrow::List<marrow::EdgeMap>& edges) {
  return shipped::refusal("similarity.contour_distance", inputs(views, edges));
}

TEST(ContourDistance, IsTheDistanceThatOneComputesByHand) {
  const auto cost = contour_distance(one_view(), edge_maps(line_at(100.25, -1)), fixed_offset());
  for (const double x : {-7.0, -2.0, 0.25, 1.0, 4.0}) {
    const double distance = x - 0.25;
    EXPECT_NEAR(cost->value(shifted(x)), std::sqrt(1 + distance * distance) - 1, 1e-5) << x;
  }
  EXPECT_NEAR(cost->value(shifted(30)), std::sqrt(101.0) - 1, 1e-5) << "beyond the reach";
}

TEST(ContourDistance, OfEitherPolarityTheNearerEdgeCounts) {
  // Darker outside at 103, brighter outside at 98.
  marrow::EdgeMap map = line_at(103, 1);
  for (const marrow::EdgePixel& pixel : line_at(98, -1).pixels) map.pixels.push_back(pixel);
  std::sort(map.pixels.begin(), map.pixels.end(),
            [](const auto& a, const auto& b) { return a.v_px != b.v_px ? a.v_px < b.v_px : a.u_px < b.u_px; });
  for (const bool symmetric : {false, true}) {
    shipped::Options options = fixed_offset();
    options["symmetric"] = symmetric;
    const auto one = contour_distance(one_view(), edge_maps(map), options);
    options["polarity"] = std::string("either");
    const auto both = contour_distance(one_view(), edge_maps(map), options);
    EXPECT_GT(one->value(shifted(3)), one->value(shifted(2)));
    EXPECT_NEAR(both->value(shifted(3)), 0, symmetric ? 0.3 : 1e-5);
    EXPECT_NEAR(both->value(shifted(-2)), 0, symmetric ? 0.3 : 1e-5);
    if (symmetric) continue;
    EXPECT_NEAR(both->value(shifted(2)), std::sqrt(2.0) - 1, 1e-5);
    EXPECT_NEAR(one->value(shifted(2)), std::sqrt(17.0) - 1, 1e-5);
  }
}

TEST(ContourDistance, InAPhotographBlurMovesEdgesToNoSide) {
  // A step blurred by 2 px. In an X-ray image, such an edge is expected 1.5 px inside the outline.
  cv::Mat1f blurred(200, 200);
  for (int v = 0; v < 200; ++v)
    for (int u = 0; u < 200; ++u) blurred(v, u) = float(70 + 30 * std::erf((99.5 - u) / (2 * std::sqrt(2.0))));
  marrow::List<marrow::View> views;
  views.add("lateral", marrow::View{"lateral", {blurred}, shapes::c_arm(0, 200), {}});
  // The search for the offset ends 3 px from the expected one. An edge 4 px inside is reached with x_ray only.
  const auto cost = [&](bool x_ray) {
    return contour_distance(views, edge_maps(line_at(99.5, -1)),
                            {{"x_ray", x_ray}, {"contour_spacing_px", 1.0}, {"reach_px", 10.0}})
        ->value(shifted(99.5 - 100 - 4));
  };
  EXPECT_LT(cost(true), 0.01);
  EXPECT_NEAR(cost(false), std::sqrt(2.0) - 1, 0.01);
}

TEST(ContourDistance, EdgesOfTheOtherDirectionDoNotCount) {
  marrow::EdgeMap map = line_at(100, -1);
  for (const auto& edge : line_at(103, 1).pixels) map.pixels.push_back(edge);
  const auto cost = contour_distance(one_view(), edge_maps(map), fixed_offset());
  EXPECT_NEAR(cost->value(shifted(3)), std::sqrt(10.0) - 1, 1e-5);
}

TEST(ContourDistance, PointsOfADirectionThatNoEdgeHasPayTheMost) {
  shipped::Inputs in = inputs(one_view(), edge_maps(line_at(100, -1)));
  in.at("projector") = marrow::Value::of<marrow::OutlineProjector>(std::make_shared<const TwoSidedProjector>());
  const marrow::Value cost = shipped::call("similarity.contour_distance", in, fixed_offset()).at("cost");
  const double worst = std::sqrt(101.0) - 1;
  EXPECT_NEAR(cost.as<marrow::Cost>().value(shifted(2)), 0.5 * (std::sqrt(5.0) - 1) + 0.5 * worst, 1e-5);
}

TEST(ContourDistance, OffsetIsGivenOrFound) {
  // The edges lie 2 px to the right of u = 100. The outline faces left, so this is 2 px inside.
  const auto edges = edge_maps(line_at(102, -1));
  EXPECT_NEAR(contour_distance(one_view(), edges, fixed_offset(-2))->value(shifted(0)), 0, 1e-5);
  EXPECT_NEAR(contour_distance(one_view(), edges, fixed_offset(2))->value(shifted(0)), std::sqrt(17.0) - 1, 1e-5);
  shipped::Options found = fixed_offset();
  found["estimate_offset"] = true;
  EXPECT_NEAR(contour_distance(one_view(), edges, found)->value(shifted(0)), 0, 1e-5);
  // The offset explains at most 3 px.
  EXPECT_NEAR(contour_distance(one_view(), edges, found)->value(shifted(-3)), std::sqrt(5.0) - 1, 1e-5);
}

TEST(ContourDistance, PointsOutsideImageAndMaskDoNotPay) {
  marrow::EdgeMap map = line_at(100, -1);
  for (auto& edge : map.pixels)
    if (edge.v_px > 95) edge.u_px = 150;
  const auto all = contour_distance(one_view(), edge_maps(map), fixed_offset());
  EXPECT_GT(all->value(shifted(0)), 2);
  cv::Mat mask(200, 200, CV_8U, cv::Scalar(1));
  mask.rowRange(85, 200).setTo(0);
  shipped::Options options = fixed_offset();
  options["contour_spacing_px"] = 0.5;  // 69 points of the upper part remain
  EXPECT_NEAR(contour_distance(one_view(mask), edge_maps(map), options)->value(shifted(0)),
              51.0 / 120 * all->value(shifted(100)), 1e-5)
      << "60 px of outline are the least that is evidence";
  EXPECT_NEAR(all->value(shifted(0, 500)), std::sqrt(101.0) - 1, 1e-5) << "nothing to compare is the worst";
}

TEST(ContourDistance, LevelsHaveTheirOwnReach) {
  const auto coarse = contour_distance(one_view(), edge_maps(line_at(100, -1)), fixed_offset())->at_level({5, 4});
  EXPECT_NEAR(coarse->value(shifted(30)), std::sqrt(17.0) - 1, 1e-5);
}

TEST(ContourDistance, WithoutEachBlockIsTheMeanOverTheOthers) {
  // The 100 points lie in the fifth column of blocks of 25 px, 25 in each of four rows. In the first two rows they are
  // 2 px away from the edges, in the others 1 px.
  marrow::EdgeMap map = line_at(101, -1);
  for (auto& edge : map.pixels)
    if (edge.v_px < 100) edge.u_px = 102;
  const auto cost = contour_distance(one_view(), edge_maps(map), fixed_offset());
  const double near = std::sqrt(2.0) - 1, far = std::sqrt(5.0) - 1;
  EXPECT_NEAR(cost->value(shifted(0)), (near + far) / 2, 2e-2) << "a point beside the step may be nearer to the other";
  const std::vector<double> without = cost->without_each_block(shifted(0));
  ASSERT_EQ(without.size(), 8u * 8);
  for (std::size_t i = 0; i < without.size(); ++i) {
    const double expected = i == 20 || i == 28   ? (2 * near + far) / 3
                            : i == 36 || i == 44 ? (near + 2 * far) / 3
                                                 : (near + far) / 2;
    EXPECT_NEAR(without[i], expected, 2e-2) << i;
  }
}

TEST(ContourDistance, SaysWhatIsWrong) {
  EXPECT_EQ(message(one_view(), edge_maps(marrow::EdgeMap{200, 200, {}})),
            "view 'lateral': the edge map is empty, so nothing can be compared; lower the thresholds of the edge "
            "detector, or "
            "check that the image shows the bone");
  marrow::EdgeMap small = line_at(50, 1);
  small.width_px = 100;
  EXPECT_EQ(message(one_view(), edge_maps(small)),
            "view 'lateral': the edge map has 100 x 200 pixels, but the camera 200 x 200; give the edges of this "
            "view's own image");
  EXPECT_EQ(message(one_view(), {}), "there are 1 views, but edge maps of 0; give the edges of each view");
  EXPECT_EQ(message(one_view(cv::Mat(200, 200, CV_8U, cv::Scalar(0))), edge_maps(line_at(50, 1))),
            "view 'lateral': no edge lies inside the mask; widen the mask");
}

TEST(NearestOutline, IsThatOfASearchThroughAll) {
  std::vector<marrow::OutlinePoint> points;
  for (int i = 0; i < 300; ++i) {
    const double angle = 0.7 * i;
    points.push_back({float((i * 37) % 131) - 5, float((i * 53) % 101) - 5, float(std::cos(angle)),
                      float(std::sin(angle)), Eigen::Vector3f::Zero()});
  }
  for (const double reach_px : {0.5, 4.0, 9.0}) {
    const marrow::match::NearestOutline nearest(points, 120, 90, reach_px);
    int within = 0;
    for (float v = -2; v < 94; v += 1.7f)
      for (float u = -2; u < 124; u += 1.9f) {
        const marrow::EdgePixel edge{u, v, 0.6f, 0.8f, 1};
        double best = reach_px;
        int expected = -1;
        for (std::size_t i = 0; i < points.size(); ++i) {
          const double away = std::hypot(double(points[i].u_px) - u, double(points[i].v_px) - v);
          if (away < best - 1e-6 && 0.6 * double(points[i].normal_u) + 0.8 * double(points[i].normal_v) >= 0.5)
            best = away, expected = int(i);
        }
        const int found = nearest.find(edge, reach_px, 0.5f);
        ASSERT_EQ(found < 0, expected < 0) << u << " " << v << " " << reach_px;
        if (found < 0) continue;
        ++within;
        EXPECT_NEAR(
            std::hypot(double(points[std::size_t(found)].u_px) - u, double(points[std::size_t(found)].v_px) - v), best,
            1e-4);
      }
    EXPECT_GT(within, 5);
  }
}

TEST(ContourDistance, SaysWhatIsEmpty) {
  const auto said = [](const marrow::List<marrow::View>& views, const marrow::EdgeMap& map, double x, double z = 0) {
    return contour_distance(views, edge_maps(map), fixed_offset())->nothing_compared(shifted(x, z));
  };
  EXPECT_EQ(said(one_view(), line_at(100, -1), 9), "") << "within the reach of 10 px";
  EXPECT_EQ(said(one_view(), line_at(100, -1), 30), "view 'lateral': no edge lies within 10 px of the model's outline");
  EXPECT_EQ(said(one_view(), line_at(100, 1), 0), "view 'lateral': no edge lies within 10 px of the model's outline")
      << "none of the outline's direction";
  EXPECT_EQ(said(one_view(), line_at(100, -1), 0, 500),
            "view 'lateral': it shows nothing of the model's outline, which is empty or outside the image");
  cv::Mat mask(200, 200, CV_8U, cv::Scalar(0));
  mask(cv::Rect(0, 0, 20, 200)).setTo(1);
  EXPECT_EQ(said(one_view(mask), line_at(10, -1), 0), "view 'lateral': the mask hides the whole outline of the model");
}

TEST(ContourDistance, APoseThatIsNotANumberIsTheWorst) {
  const auto cost = contour_distance(one_view(), edge_maps(line_at(100, -1)), fixed_offset());
  EXPECT_EQ(cost->value(shifted(std::nan(""))), cost->value(shifted(500)));
}

}  // namespace contour_distance_test
