// SPDX-License-Identifier: Apache-2.0
// A box of metal in an image of two grey values, one in its shadow and one beside it.
#include <gtest/gtest.h>

#include "marrow/domain/functions.hpp"
#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"

namespace silhouette_overlap_test {

using namespace marrow;

constexpr int kSize_px = 200;

/// 2 pixels a mm at the box, whose shadow is 80 x 60 pixels around (100, 100).
View view(double inside, double outside) {
  View view;
  view.name = "first";
  view.camera.width_px = view.camera.height_px = kSize_px;
  view.camera.intrinsics << 2000, 0, 100, 0, 2000, 100, 0, 0, 1;
  view.image.pixels = cv::Mat(kSize_px, kSize_px, CV_8U, cv::Scalar(outside));
  view.image.pixels(cv::Rect(60, 70, 81, 61)).setTo(inside);
  return view;
}

RigidTransform placed(double x_mm) { return {"world", "ct", Eigen::Matrix3d::Identity(), {x_mm, 0, 1000}}; }

double cost(const View& view, const std::string& polarity, double x_mm) {
  List<View> views;
  views.add(view.name, view);
  const shipped::Inputs inputs{{"model", shipped::item(test::box({0, 0, 0}, {40, 30, 0.02}))},
                               {"views", shipped::list(views, "view")}};
  const Value made =
      shipped::call("similarity.silhouette_overlap", inputs, {{"polarity", polarity}, {"band_px", 20.0}}).at("cost");
  return made.as<Cost>().value(placed(x_mm));
}

struct Metal {
  std::string polarity;
  double inside, outside;
  bool is_seen;
};
class SilhouetteOverlap : public testing::TestWithParam<Metal> {};

TEST_P(SilhouetteOverlap, IsWholeWhereTheMetalIs) {
  const View seen = view(GetParam().inside, GetParam().outside);
  if (!GetParam().is_seen) {
    EXPECT_EQ(cost(seen, GetParam().polarity, 0), 1) << "metal of the other polarity";
    return;
  }
  EXPECT_NEAR(cost(seen, GetParam().polarity, 0), 0, 0.03);
  double before = cost(seen, GetParam().polarity, 0);
  for (const double off_mm : {2.0, 5.0, 10.0, 15.0}) {
    EXPECT_GT(cost(seen, GetParam().polarity, off_mm), before) << off_mm;
    before = cost(seen, GetParam().polarity, off_mm);
  }
}
INSTANTIATE_TEST_SUITE_P(Polarity, SilhouetteOverlap,
                         testing::Values(Metal{"dark", 10, 200, true}, Metal{"bright", 200, 10, true},
                                         Metal{"either", 10, 200, true}, Metal{"either", 200, 10, true},
                                         Metal{"dark", 200, 10, false}, Metal{"bright", 10, 200, false}));

// Shifted by 10 mm, 20 pixels: of the silhouette's 80 columns, 60 are on metal. The band adds 20 pixels around, with
// round corners. The squared Matthews correlation follows from the four counts.
TEST(SilhouetteOverlapValue, IsTheMatthewsCorrelation) {
  const double in = 80 * 60, band = 2 * 20 * (80 + 60) + 3.14159 * 20 * 20, metal_in = 60 * 60, metal_out = 20 * 60;
  const double all = in + band, metal = metal_in + metal_out;
  const double phi =
      (metal_in * (band - metal_out) - (in - metal_in) * metal_out) / std::sqrt(in * band * metal * (all - metal));
  EXPECT_NEAR(cost(view(10, 200), "dark", 10), 1 - phi * phi, 0.02);
}

TEST(SilhouetteOverlapValue, IsTheWorstWithoutAnyMetal) { EXPECT_EQ(cost(view(90, 90), "either", 0), 1); }

}  // namespace silhouette_overlap_test
