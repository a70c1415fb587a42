// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/domain/features.hpp>

#include "blob_scene.hpp"
#include "other_fragment.hpp"
#include "shipped.hpp"

namespace drr_edges_test {

using blob_scene::at;
using marrow::RadiographProjector;
using pixelwise_projector::PixelwiseProjector;

constexpr double kWidth_px = 2.5;

/// An upright wall: rays to the right of u = 100 + x cross it. Its border is blurred by an error function.
class WallProjector : public PixelwiseProjector {
 public:
  marrow::PixelGrid region(const marrow::Camera&, const marrow::RigidTransform& pose) const override {
    return std::abs(pose.translation_mm.x()) < 60 ? marrow::PixelGrid{60, 20, 1, 80, 130} : marrow::PixelGrid{};
  }

 protected:
  double integral(const Eigen::Vector2d& pixel, const marrow::RigidTransform& pose) const override {
    return 20 + 20 * std::erf((pixel.x() - 100 - pose.translation_mm.x()) / (std::sqrt(2.0) * kWidth_px));
  }
};

/// A wall whose normal points 30 degrees downwards, through (100 + x, 80).
class ObliqueWallProjector : public PixelwiseProjector {
 public:
  static Eigen::Vector2d normal() { return {std::cos(marrow::radians(30)), std::sin(marrow::radians(30))}; }
  marrow::PixelGrid region(const marrow::Camera&, const marrow::RigidTransform&) const override {
    return {70, 50, 1, 60, 60};
  }

 protected:
  double integral(const Eigen::Vector2d& pixel, const marrow::RigidTransform& pose) const override {
    const double across = normal().dot(pixel - Eigen::Vector2d(100 + pose.translation_mm.x(), 80));
    return 20 + 20 * std::erf(across / (std::sqrt(2.0) * kWidth_px));
  }
};

/// A square. The region ends at the square or `around_px` further out.
class SquareProjector : public PixelwiseProjector {
 public:
  explicit SquareProjector(int around_px) : around_px_(around_px) {}
  marrow::PixelGrid region(const marrow::Camera&, const marrow::RigidTransform&) const override {
    return {80.0 - around_px_, 60.0 - around_px_, 1, 40 + 2 * around_px_, 40 + 2 * around_px_};
  }

 protected:
  double integral(const Eigen::Vector2d& p, const marrow::RigidTransform&) const override {
    return p.x() >= 80 && p.x() < 120 && p.y() >= 60 && p.y() < 100 ? 10 : 0;
  }

 private:
  const int around_px_;
};

/// Edges at u that face left, as the wall's edges do: the image is brighter on the left.
shipped::Inputs inputs(double u, float direction = -1) {
  marrow::EdgeMap map{200, 170, {}};
  for (int v = 0; v < 170; ++v) map.pixels.push_back({float(u), float(v), direction, 0, 1});
  marrow::List<marrow::EdgeMap> edges;
  edges.add("frontal", map);
  return {{"projector", marrow::Value::of<RadiographProjector>(std::make_shared<const WallProjector>())},
          {"views", shipped::list(blob_scene::views_of(blob_scene::view_of()), "view")},
          {"edges", shipped::list(edges, "view")}};
}

double value(const shipped::Inputs& inputs, const marrow::RigidTransform& pose, std::int64_t step = 1) {
  const marrow::Value cost =
      shipped::call("similarity.drr_edges", inputs, {{"pixel_step", step}, {"reach_px", 10.0}}).at("cost");
  return cost.as<marrow::Cost>().value(pose);
}

double loss(double distance) { return std::sqrt(1 + distance * distance) - 1; }

TEST(DrrEdges, FindsTheRadiographsEdgesBetweenPixels) {
  for (const std::int64_t step : {1, 2, 3})
    for (const double x : {-4.0, -1.3, 0.0, 0.45, 2.0})
      EXPECT_NEAR(value(inputs(100.4), at(x, 0), step), loss(x - 0.4), 0.05) << step << " " << x;
}

TEST(DrrEdges, DistancesAreAcrossAnObliqueEdge) {
  marrow::EdgeMap map{200, 170, {}};
  const Eigen::Vector2d normal = ObliqueWallProjector::normal();
  for (int v = 10; v < 160; ++v)
    map.pixels.push_back(
        {float(100 - (v - 80) * normal.y() / normal.x()), float(v), float(-normal.x()), float(-normal.y()), 1});
  marrow::List<marrow::EdgeMap> edges;
  edges.add("frontal", map);
  shipped::Inputs in = inputs(100);
  in["projector"] = marrow::Value::of<RadiographProjector>(std::make_shared<const ObliqueWallProjector>());
  in["edges"] = shipped::list(edges, "view");
  for (const double x : {-4.0, 0.0, 2.0}) EXPECT_NEAR(value(in, at(x, 0)), loss(x * normal.x()), 0.05) << x;
}

TEST(DrrEdges, DistancesAlongAnEdgeBeginBeyondAPixel) {
  // A single edge pixel at (101, 80). The wall's points in rows 15 to 155 lie 1 px away across the edge, and up to 75
  // px along it.
  marrow::EdgeMap map{200, 170, {{101, 80, -1, 0, 1}}};
  marrow::List<marrow::EdgeMap> edges;
  edges.add("frontal", map);
  shipped::Inputs in = inputs(100);
  in["edges"] = shipped::list(edges, "view");
  double expected = 0;
  for (int v = 15; v <= 155; ++v)
    expected += loss(std::min(10.0, std::hypot(1, std::max(0.0, std::abs(v - 80) - 1.5)))) / 141;
  EXPECT_NEAR(value(in, at(0, 0)), expected, 0.01);
}

TEST(DrrEdges, WhatDoesNotMatchIsTheWorst) {
  EXPECT_NEAR(value(inputs(130), at(0, 0)), loss(10), 1e-9) << "beyond the reach";
  EXPECT_NEAR(value(inputs(100, 1), at(0, 0)), loss(10), 1e-9) << "edges of the other direction";
  EXPECT_NEAR(value(inputs(100), at(80, 0)), loss(10), 1e-9) << "out of view";
}

TEST(DrrEdges, BlurReachesBeyondTheRegion) {
  const auto value_with = [](int around_px, double blur_px) {
    shipped::Inputs in = inputs(81);
    in["projector"] = marrow::Value::of<RadiographProjector>(std::make_shared<const SquareProjector>(around_px));
    const marrow::Value cost =
        shipped::call("similarity.drr_edges", in, {{"blur_px", blur_px}, {"reach_px", 10.0}}).at("cost");
    return cost.as<marrow::Cost>().value(at(0, 0));
  };
  for (const double blur_px : {1.5, 4.0}) EXPECT_NEAR(value_with(0, blur_px), value_with(30, blur_px), 1e-3) << blur_px;
}

TEST(DrrEdges, AnotherFragmentsEdgesDoNotCount) {
  // Only the edges of the square's left border, which the wall meets too.
  marrow::EdgeMap map{200, 170, {}};
  for (int v = 60; v < 90; ++v) map.pixels.push_back({101, float(v), -1, 0, 1});
  marrow::List<marrow::EdgeMap> edges;
  edges.add("frontal", map);
  shipped::Inputs in = inputs(100);
  in["edges"] = shipped::list(edges, "view");
  EXPECT_LT(value(in, at(1, 0)), loss(10) - 1);
  const auto own = std::make_shared<const other_fragment::SquareOutline>(),
             other = std::make_shared<const other_fragment::SquareOutline>();
  shipped::Inputs told = other_fragment::Fragments<marrow::OutlineProjector>{own, other}.with(in);
  told["outline"] = told.at("projector");
  told["projector"] = in.at("projector");
  EXPECT_NEAR(value(told, at(1, 0)), loss(10), 1e-9);
  told.erase("outline");
  EXPECT_EQ(shipped::refusal("similarity.drr_edges", told),
            "there are other fragments, but it is not known which of them is this one; wire 'outline', the one that "
            "draws this fragment");
}

TEST(DrrEdges, Levels) {
  const shipped::Inputs in = inputs(100);
  const marrow::Value cost = shipped::call("similarity.drr_edges", in).at("cost");
  const auto coarse = cost.as<marrow::Cost>().at_level({4, 20, 4});
  EXPECT_NEAR(coarse->value(at(80, 0)), loss(20), 1e-9);
  EXPECT_LT(coarse->value(at(0, 0)), 0.1);
  EXPECT_NEAR(coarse->value(at(12, 0)), loss(12), 0.5);
}

TEST(DrrEdges, SaysWhatIsEmpty) {
  const auto said = [](const shipped::Inputs& inputs, double x) {
    const marrow::Value cost = shipped::call("similarity.drr_edges", inputs, {{"reach_px", 10.0}}).at("cost");
    return cost.as<marrow::Cost>().nothing_compared(at(x, 0));
  };
  EXPECT_EQ(said(inputs(100), 5), "");
  EXPECT_EQ(said(inputs(130), 0), "view 'frontal': no edge lies within 10 px of the radiograph's edges");
  EXPECT_EQ(said(inputs(100), 80),
            "view 'frontal': it shows no edge of the radiograph, which is empty or outside the image");
  shipped::Inputs masked = inputs(100);
  marrow::View view = blob_scene::view_of();
  view.mask = cv::Mat(170, 200, CV_8U, cv::Scalar(0));
  masked["views"] = shipped::list(blob_scene::views_of(view), "view");
  EXPECT_EQ(said(masked, 0), "view 'frontal': no edge of the radiograph lies inside image and mask");
}

}  // namespace drr_edges_test
