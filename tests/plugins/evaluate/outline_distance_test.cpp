// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "shipped.hpp"
#include "tests/plugins/evaluate/listener.hpp"

namespace outline_distance_test {

/// An outline that is the vertical line u = 100 from v = 20 to 119, normal to the right; it ignores the pose.
class LineProjector : public marrow::OutlineProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera, const marrow::RigidTransform&,
                                            double) const override {
    std::vector<marrow::OutlinePoint> points;
    if (camera.width_px <= 100) return points;
    for (int v = 20; v < 120; ++v) points.push_back({100, float(v), 1, 0, Eigen::Vector3f(0, 0, 600)});
    return points;
  }
};

/// An outline of one point.
class PointProjector : public marrow::OutlineProjector {
 public:
  explicit PointProjector(const marrow::OutlinePoint& point) : point_(point) {}
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform&,
                                            double) const override {
    return {point_};
  }

 private:
  marrow::OutlinePoint point_;
};

/// Focal length 1000 px, so that 1 px is 0.6 mm at the outline's depth of 600 mm.
marrow::View view(const std::string& name, int width = 200) {
  marrow::View view;
  view.name = name;
  view.image.pixels = cv::Mat(150, width, CV_8U, cv::Scalar(128));
  view.camera.width_px = width;
  view.camera.height_px = 150;
  view.camera.intrinsics << 1000, 0, 100, 0, 1000, 75, 0, 0, 1;
  return view;
}

marrow::EdgeMap line_of_edges(float u, float direction_u, int from_v = 0, int to_v = 150) {
  marrow::EdgeMap edges{200, 150, {}};
  for (int v = from_v; v < to_v; ++v) edges.pixels.push_back({u, float(v), direction_u, 0, 10});
  return edges;
}

template <class Projector = LineProjector>
shipped::Inputs inputs(const marrow::List<marrow::View>& views, const marrow::List<marrow::EdgeMap>& edges,
                       const Projector& projector = {}) {
  return {{"pose", shipped::item(marrow::Pose())},
          {"projector", marrow::Value::of<marrow::OutlineProjector>(std::make_shared<const Projector>(projector))},
          {"views", shipped::list(views, "view")},
          {"edges", shipped::list(edges, "view")}};
}

std::map<std::string, double> distances(const shipped::Inputs& inputs, const shipped::Options& options = {}) {
  const auto metrics = shipped::call("evaluate.outline_distance", inputs, options).at("metrics");
  std::map<std::string, double> values;
  for (const auto& item : metrics.as<marrow::Metrics>().items) values[item.name] = item.value;
  return values;
}
std::map<std::string, double> distances(const marrow::List<marrow::View>& views,
                                        const marrow::List<marrow::EdgeMap>& edges,
                                        const shipped::Options& options = {}) {
  return distances(inputs(views, edges), options);
}

template <class T>
marrow::List<T> one(const std::string& name, T item) {
  marrow::List<T> list;
  list.add(name, std::move(item));
  return list;
}

TEST(OutlineDistance, OfAParallelLine) {
  auto found = distances(one("frontal", view("frontal")), one("frontal", line_of_edges(102.5f, 1)));
  EXPECT_NEAR(found["median_px"], 2.5, 1e-6);
  EXPECT_NEAR(found["p90_px"], 2.5, 1e-6);
  EXPECT_NEAR(found["offset_px"], 2.5, 1e-6);
  EXPECT_NEAR(found["spread_px"], 0, 1e-6);
  EXPECT_NEAR(found["median_mm"], 2.5 * 0.6, 1e-6);
  EXPECT_NEAR(found["matched_percent"], 100, 1e-9);
  EXPECT_NEAR(found["frontal_median_px"], 2.5, 1e-6);
}

TEST(OutlineDistance, EdgesOfAnotherDirectionDoNotCount) {
  marrow::EdgeMap edges = line_of_edges(109, 1);
  for (const auto& edge : line_of_edges(101, -1).pixels) edges.pixels.push_back(edge);
  EXPECT_NEAR(distances(one("frontal", view("frontal")), one("frontal", edges))["median_px"], 9, 1e-6);
  const shipped::Options options{{"direction_tolerance_deg", 180.0}};
  EXPECT_NEAR(distances(one("frontal", view("frontal")), one("frontal", edges), options)["median_px"], 1, 1e-6);
}

TEST(OutlineDistance, UnmatchedPointsCountWithTheReach) {
  // Only the upper 60 of 100 outline points have edges beside them. The lower ones are farther away than the reach of 5
  // px, except 4 of them: v = 80 to 83 reach the last edge at v = 79, 3 px to the side.
  const shipped::Options options{{"reach_px", 5.0}};
  auto found = distances(one("frontal", view("frontal")), one("frontal", line_of_edges(103, 1, 0, 80)), options);
  EXPECT_NEAR(found["median_px"], 3, 1e-6);
  EXPECT_NEAR(found["p90_px"], 5, 1e-6);
  EXPECT_NEAR(found["matched_percent"], 64, 1e-9);
}

TEST(OutlineDistance, ViewsTogetherAndEach) {
  marrow::List<marrow::View> views;
  views.add("frontal", view("frontal"));
  views.add("lateral", view("lateral"));
  marrow::List<marrow::EdgeMap> edges;
  edges.add("frontal", line_of_edges(101, 1));
  edges.add("lateral", line_of_edges(104, 1));
  auto found = distances(views, edges);
  EXPECT_NEAR(found["frontal_median_px"], 1, 1e-6);
  EXPECT_NEAR(found["lateral_median_px"], 4, 1e-6);
  EXPECT_NEAR(found["median_px"], 2.5, 1e-6);
}

TEST(OutlineDistance, MaskedPointsAreLeftOut) {
  marrow::View masked = view("frontal");
  masked.mask = cv::Mat(150, 200, CV_8U, cv::Scalar(0));
  masked.mask.rowRange(0, 60).setTo(255);
  auto found = distances(one("frontal", masked), one("frontal", line_of_edges(102, 1, 0, 60)));
  EXPECT_NEAR(found["matched_percent"], 100, 1e-9);
  EXPECT_NEAR(found["p90_px"], 2, 1e-6);
}

TEST(OutlineDistance, FindsFarEdgesAcrossCells) {
  const shipped::Options options{{"reach_px", 500.0}};
  EXPECT_NEAR(distances(one("frontal", view("frontal")), one("frontal", line_of_edges(199, 1)), options)["p90_px"], 99,
              1e-6);
  EXPECT_NEAR(distances(one("frontal", view("frontal")), one("frontal", line_of_edges(0, 1)), options)["p90_px"], 100,
              1e-6);
}

TEST(OutlineDistance, TheNearestEdgeIsThatOfASearchThroughAll) {
  std::mt19937 random(3);
  const auto part = [&] { return double(random()) / 4294967296.0; };
  marrow::EdgeMap edges{203, 149, {}};
  for (int i = 0; i < 120; ++i) {
    const double angle = 6.28 * part();
    edges.pixels.push_back(
        {float(203 * part()), float(149 * part()), float(std::cos(angle)), float(std::sin(angle)), 1});
  }
  edges.pixels.push_back({-20, 30, 1, 0, 1});  // beyond the image, as a detector may say of its border
  edges.pixels.push_back({230, 170, 1, 0, 1});
  marrow::View seen = view("frontal", 203);
  seen.image.pixels = cv::Mat(149, 203, CV_8U, cv::Scalar(128));
  seen.camera.height_px = 149;
  const auto views = one("frontal", seen);
  const auto of_views = one("frontal", edges);
  int none = 0;
  for (int i = 0; i < 3000; ++i) {
    const double u = 203 * part(), v = 149 * part(), angle = 6.28 * part(), reach_px = i % 3 == 0 ? 400 : 60 * part(),
                 angle_deg = i % 2 ? marrow::degrees(std::acos(0.9)) : 180,
                 least_cosine = std::cos(marrow::radians(angle_deg));
    const marrow::OutlinePoint point{float(u), float(v), float(std::cos(angle)), float(std::sin(angle)),
                                     Eigen::Vector3f(0, 0, 600)};
    double best = std::numeric_limits<double>::infinity();
    for (const auto& edge : edges.pixels)
      if (edge.direction_u * double(point.normal_u) + edge.direction_v * double(point.normal_v) >= least_cosine)
        best = std::min(best, std::hypot(double(edge.u_px) - point.u_px, double(edge.v_px) - point.v_px));
    auto found = distances(inputs(views, of_views, PointProjector(point)),
                           {{"reach_px", reach_px}, {"direction_tolerance_deg", angle_deg}});
    ASSERT_EQ(found["matched_percent"], best <= reach_px ? 100 : 0) << best << " px, reach " << reach_px;
    EXPECT_EQ(found["median_px"], std::min(best, reach_px));
    none += best > reach_px;
  }
  EXPECT_GT(none, 100);
  EXPECT_LT(none, 2000);
}

TEST(OutlineDistance, SpreadAndPercentilesOfARoughLine) {
  // Edges lie 1, 2, ... 10 px outside in turn. So a point's own edge is the nearest only if its neighbours' edges are
  // as far.
  marrow::EdgeMap edges{200, 150, {}};
  for (int v = 20; v < 120; ++v) edges.pixels.push_back({100 + 0.1f * float(v % 10), float(v), 1, 0, 1});
  auto found = distances(one("frontal", view("frontal")), one("frontal", edges));
  EXPECT_NEAR(found["median_px"], 0.45, 1e-5);
  EXPECT_NEAR(found["p90_px"], 0.81, 1e-5);
  EXPECT_NEAR(found["median_mm"], 0.45 * 0.6, 1e-5);
  EXPECT_NEAR(found["p90_mm"], 0.81 * 0.6, 1e-5);
  EXPECT_NEAR(found["offset_px"], 0.45, 1e-5);
  EXPECT_NEAR(found["spread_px"], 0.25, 1e-5);
  // The mask counts at the nearest pixel.
  marrow::View masked = view("frontal");
  masked.mask = cv::Mat(150, 200, CV_8U, cv::Scalar(0));
  masked.mask.col(100).setTo(1);
  EXPECT_NEAR(distances(one("frontal", masked), one("frontal", edges))["frontal_median_px"], 0.45, 1e-5);
}

TEST(OutlineDistance, AViewWithoutOutlineIsLeftOutWithAWarning) {
  marrow::List<marrow::View> views;
  views.add("frontal", view("frontal"));
  views.add("narrow", view("narrow", 90));
  marrow::List<marrow::EdgeMap> edges;
  edges.add("frontal", line_of_edges(101, 1));
  marrow::EdgeMap narrow = line_of_edges(50, 1);
  narrow.width_px = 90;
  edges.add("narrow", narrow);
  listener::Listener listener;
  const auto metrics =
      shipped::call("evaluate.outline_distance", inputs(views, edges), {}, listener.context).at("metrics");
  EXPECT_EQ(metrics.as<marrow::Metrics>().items.size(), 14u);
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_EQ(listener.warnings[0],
            "view 'narrow': no part of the outline is inside the image at this pose; the view is left out");
}

TEST(OutlineDistance, SaysWhatIsWrong) {
  const auto message = [](const marrow::List<marrow::View>& views, const marrow::List<marrow::EdgeMap>& edges) {
    return shipped::refusal("evaluate.outline_distance", inputs(views, edges));
  };
  EXPECT_EQ(message(one("frontal", view("frontal")), one("lateral", line_of_edges(101, 1))),
            "view 'frontal': there is no edge map of that name; make the edges from the same list of views");
  EXPECT_EQ(
      message(one("frontal", view("frontal")), one("frontal", marrow::EdgeMap{200, 150, {}})),
      "view 'frontal': the edge map is empty, so there is nothing to measure to; lower the edge detector's thresholds");
  EXPECT_EQ(message(one("frontal", view("frontal")), one("frontal", marrow::EdgeMap{100, 150, {{}}})),
            "view 'frontal': the edge map is for 100 x 150 pixels, the image has 200 x 150");
  marrow::EdgeMap narrow = line_of_edges(50, 1);
  narrow.width_px = 90;
  EXPECT_EQ(message(one("frontal", view("frontal", 90)), one("frontal", narrow)),
            "the outline is outside the image in every view (1), so there is no distance; check the pose and that the "
            "cameras and the model use the same world frame");
}

}  // namespace outline_distance_test
